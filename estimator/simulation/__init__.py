"""Synthetic experiments: what a rig with known truth would have written."""
