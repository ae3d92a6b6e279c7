"""`dirt-push stability`: stiff and extreme cases, each with what is right, what was measured, and whether it passes."""
