"""Externally Guided Motion: its messages, the position stream that measures, the guidance that moves."""
