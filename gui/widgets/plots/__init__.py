"""Curves, bars and drawings in the plane, in the window's theme."""
