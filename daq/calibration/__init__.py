"""Calibrations: each a function or a stepwise collector that ends in figures, a plot and a verdict, kept as a file."""
