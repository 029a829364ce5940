"""Calibrations as files: what each kind finds, with the figures that speak for it, kept and put in force."""
