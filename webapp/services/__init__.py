"""What padlab does for its users, one function for each use; no HTTP, no command line."""
