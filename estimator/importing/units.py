"""Units of what an experiment holds, in the spellings that the readers of testing machines know, and some more."""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np

from estimator.errors import InputError
from estimator.uniaxial.reading.language.units import spelt
from estimator.uniaxial.reading.language.vocabulary import UNITS as MACHINE_UNITS

Quantity = Literal["time", "length", "force", "torque", "angle"]

_MULTIPLE = re.compile(r"\s*(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)\s*([^\d\s].*)")
_LENGTHS_TOO = {"metre": 1.0, "meter": 1.0, "millimetre": 1e-3, "millimeter": 1e-3}
UNITS: Mapping[Quantity, Mapping[str, float]] = MappingProxyType(
    {
        "time": {**MACHINE_UNITS["time"], "us": 1e-6, "µs": 1e-6, "ns": 1e-9},
        "length": {**MACHINE_UNITS["length"], **_LENGTHS_TOO},
        "force": MACHINE_UNITS["force"],
        "torque": {
            "N·m": 1.0, "Nm": 1.0, "N*m": 1.0, "N.m": 1.0, "N·mm": 1e-3, "Nmm": 1e-3, "N*mm": 1e-3, "N.mm": 1e-3,
            "mNm": 1e-3, "mN·m": 1e-3, "mN*m": 1e-3, "Ncm": 1e-2, "N·cm": 1e-2, "N-m": 1.0, "N-mm": 1e-3,
            "lbf-in": 0.1129848290276167, "lb-in": 0.1129848290276167, "in-lbf": 0.1129848290276167,
            "in-lb": 0.1129848290276167, "lbf·in": 0.1129848290276167, "lbf*in": 0.1129848290276167,
        },
        "angle": {"rad": 1.0, "deg": np.pi / 180, "°": np.pi / 180, "degree": np.pi / 180, "degrees": np.pi / 180},
    }
)  # fmt: skip
"""Units of each quantity and their factors to SI."""


def factor_of(unit: str, quantity: Quantity, where: str) -> float:
    """Return the factor to SI; a number before the unit counts, as in ``0.054 mm`` for one pixel.

    Raises
    ------
    InputError
        The unit is none of this quantity.
    """
    known = UNITS[quantity]
    match = _MULTIPLE.fullmatch(unit)
    name = spelt(match[2] if match else unit)
    if name not in known:
        shown: dict[float, str] = {}
        for spelling, factor in known.items():
            shown.setdefault(factor, spelling)
        raise InputError(
            f"{where}: {unit!r} is no unit of {quantity}; write one of {', '.join(shown.values())}"
        )
    return known[name] * (float(match[1]) if match else 1.0)


def is_unit(unit: str | None, quantity: Quantity) -> bool:
    """Tell whether a unit is one of this quantity."""
    return unit is not None and spelt(unit) in UNITS[quantity]


def quantity_of(unit: str | None) -> Quantity | None:
    """Return what a unit measures; None where it is unknown."""
    return next((quantity for quantity in UNITS if is_unit(unit, quantity)), None)
