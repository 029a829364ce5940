"""Fuzz targets: what force sensors send."""
