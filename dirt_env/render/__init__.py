"""What a site looks like: a picture from above, a window, a 3-D replay for a browser, an animated picture."""
