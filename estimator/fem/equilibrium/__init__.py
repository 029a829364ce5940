"""Solving it: equilibria along a motion, and what follows from a solved one."""
