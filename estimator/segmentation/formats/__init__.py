"""Readers of label maps, one for each format."""
