"""Measurements on the paper's Pull: ``python -m benchmarks speed|online|scaling|accuracy``."""
