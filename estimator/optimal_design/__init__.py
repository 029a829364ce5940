"""Optimal experimental design: how much a planned experiment is expected to tell of which answer is right."""
