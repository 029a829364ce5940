"""Decimal numbers in the text of a device: ``float()`` would also take ``1_0``, ``inf`` and digits of other scripts."""

import math
import re

_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def decimal(text: str) -> float:
    """Return the number that ``text`` is, NaN where it is none."""
    return float(text) if _DECIMAL.fullmatch(text) else math.nan
