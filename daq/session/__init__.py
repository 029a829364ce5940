"""Carrying out a retraction: the guard that may stop it, and the session that records it."""
