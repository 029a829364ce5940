"""Commits a set to keys that nobody has seen, counts how often they are opened, and registers answers before that."""
