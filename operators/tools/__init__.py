"""One module a tool: it reads objects, calls core and writes the results."""
