"""Surfaces of phantoms: read from files, repaired where that has one meaning, and checked to be closed."""
