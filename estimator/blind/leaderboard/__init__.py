"""Ranks entries of anyone to one sealed set, and writes the page of it."""
