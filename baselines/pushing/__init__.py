"""What behaviours that push soil are made of: what is known of the site, ways, goals with room, the blade."""
