"""Estimations and diagnoses that the window starts, and their outcomes as plain values to be shown."""
