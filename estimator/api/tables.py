"""Results as tables of other programs."""

import math
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

from estimator.errors import InputError


def dataframe(columns: Mapping[str, Sequence[object]], index: str = "") -> Any:
    """Return columns of equal length as a ``pandas.DataFrame``; pandas is no part of what this package needs.

    Parameters
    ----------
    columns : by name, in their order
    index : name of the column that names the rows; empty for their numbers

    Raises
    ------
    InputError
        pandas is not installed.
    """
    try:
        pandas = import_module("pandas")
    except ImportError:
        raise InputError(
            "a DataFrame needs pandas, which is not installed; run pip install pandas, or take to_dict()"
        ) from None
    frame = pandas.DataFrame(dict(columns))
    return frame.set_index(index) if index else frame


def known(value: object) -> object:
    """Return a value as JSON has it: None for a number that is not known."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
