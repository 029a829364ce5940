"""A serial line: the port, and a thread that empties it."""
