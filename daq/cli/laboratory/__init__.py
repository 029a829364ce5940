"""Verbs of the laboratory: its devices, its window, its calibration, and what is tried on a virtual one."""
