"""Departures of the real rig from the baseline model, one small file each, and the catalogue of them."""
