"""Who sees what, and in which order."""
