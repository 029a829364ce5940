"""Round numbers for scales: 1, 2 and 5 times a power of ten."""

import math


def round_figure(at_most: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not above a positive number."""
    decade = 10.0 ** math.floor(math.log10(at_most))
    return max(step * decade for step in (1, 2, 5) if step * decade <= at_most)


def round_figure_above(at_least: float) -> float:
    """Return the smallest of 1, 2 and 5 times a power of ten that is not below a positive number."""
    decade = 10.0 ** math.floor(math.log10(at_least))
    return min(step * decade for step in (1, 2, 5, 10) if step * decade >= at_least)
