"""The tools: they read objects, call core and write the results."""
