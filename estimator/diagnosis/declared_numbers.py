"""Numbers that are declared with their unit, their kind and their reason, as fields of dataclasses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Any, Literal, TypeVar, get_args

from estimator.errors import InputError

Kind = Literal["definition", "grid", "budget", "calibrated"]
KINDS: tuple[Kind, ...] = get_args(Kind)
T = TypeVar("T")


def _number(value: T, unit: str, kind: Kind, reason: str) -> T:
    found: T = field(default=value, metadata={"unit": unit, "kind": kind, "reason": reason})
    return found


def definition(value: T, unit: str, reason: str) -> T:
    """Declare what a word means."""
    return _number(value, unit, "definition", reason)


def grid(value: T, unit: str, reason: str) -> T:
    """Declare the points of a quadrature."""
    return _number(value, unit, "grid", reason)


def budget(value: T, unit: str, reason: str) -> T:
    """Declare a limit of work."""
    return _number(value, unit, "budget", reason)


def calibrated(value: T, unit: str, reason: str) -> T:
    """Declare what cases with known answers have shown."""
    return _number(value, unit, "calibrated", reason)


@dataclass(frozen=True)
class Number:
    """One declared number.

    Attributes
    ----------
    name : "layer.field"
    value : a number, or the points of a grid
    unit, kind, reason : as it was declared
    """

    name: str
    value: float | tuple[float, ...]
    unit: str
    kind: Kind
    reason: str


def declared(layers: Any) -> Iterator[Number]:
    """Yield every number of a dataclass whose fields are dataclasses of numbers, one after the other."""
    for layer in fields(layers):
        of_layer = getattr(layers, layer.name)
        for one in fields(of_layer):
            yield Number(f"{layer.name}.{one.name}", getattr(of_layer, one.name), **one.metadata)


def check(number: Number) -> None:
    """Refuse what cannot be such a number.

    Raises
    ------
    InputError
        It is not finite, or negative, or a grid without points.
    """
    values = number.value if isinstance(number.value, tuple) else (number.value,)
    if not values or not all(math.isfinite(value) and value >= 0.0 for value in values):
        raise InputError(
            f"{number.name} is {number.value}; it must be finite and not negative, and a grid needs points"
        )
