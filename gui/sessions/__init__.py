"""Recorded sessions: found, listed, played."""
