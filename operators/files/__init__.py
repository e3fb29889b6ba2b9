"""Files of points and of results, and the command line."""
