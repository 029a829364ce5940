"""Verbs of the diagnosis: of one case, of a folder of them, and of bench tests."""
