"""Verbs of sessions: recorded, recovered, played, exported."""
