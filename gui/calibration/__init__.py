"""A calibration at the window: who is asked for what, and what is made of it."""
