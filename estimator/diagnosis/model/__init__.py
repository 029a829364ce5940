"""A hypothesis and its solved load steps."""
