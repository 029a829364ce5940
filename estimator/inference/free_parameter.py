"""A free parameter of a model at its present value: the scale on which it is nearly linear, its bounds, its prior."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# The end of an interval that says nothing may lie beyond what a number can be.
_LARGEST_EXPONENT = 700.0


@dataclass(frozen=True, slots=True)
class Transform:
    """A monotone transformation to the internal variable in which a model is nearly linear.

    Attributes
    ----------
    internal_of, value_of : the transformation and its inverse
    slope : derivative of the value by the internal variable, at a value
    """

    internal_of: Callable[[float], float]
    value_of: Callable[[float], float]
    slope: Callable[[float], float]


def _itself(value: float) -> float:
    return value


def _times(factor: float, value: float) -> float:
    return factor * value


def _constant(slope: float, value: float) -> float:
    del value
    return slope


def _exponential(internal: float) -> float:
    return math.exp(min(internal, _LARGEST_EXPONENT))


def in_units_of(unit: float) -> Transform:
    """Return the transformation of a value to its size in a unit."""
    return Transform(partial(_times, 1 / unit), partial(_times, unit), partial(_constant, unit))


IDENTITY = Transform(_itself, _itself, partial(_constant, 1.0))
LOGARITHM = Transform(math.log, _exponential, _itself)


class Prior(Protocol):
    """What is known of a parameter beforehand, as a normal distribution about where it is linearised."""

    def precision(self, slope: float) -> float:
        """Return the inverse deviation of the internal variable; ``slope`` is that of the value by it."""
        ...

    def offset(self, value: float) -> float:
        """Return by how many deviations a value is above the mean."""
        ...


@dataclass(frozen=True, slots=True)
class NormalPrior:
    """A normal prior of the value, in the parameter's unit."""

    mean: float
    std: float

    def precision(self, slope: float) -> float:
        """Return the inverse deviation of the internal variable."""
        return slope / self.std

    def offset(self, value: float) -> float:
        """Return by how many deviations a value is above the mean."""
        return (value - self.mean) / self.std


@dataclass(frozen=True, slots=True)
class InternalPrior:
    """A normal prior of the internal variable: a median of the value, and a deviation in internal units."""

    median: float
    std: float
    internal_of: Callable[[float], float]

    def precision(self, slope: float) -> float:
        """Return the inverse deviation of the internal variable, which is the same everywhere."""
        del slope
        return 1.0 / self.std

    def offset(self, value: float) -> float:
        """Return by how many deviations a value is above the median."""
        return (self.internal_of(value) - self.internal_of(self.median)) / self.std


@dataclass(frozen=True, slots=True)
class RangePrior:
    """A prior that is flat over a range so wide, internal units: it holds a step back and pulls to no place."""

    width: float

    def precision(self, slope: float) -> float:
        """Return the inverse width."""
        del slope
        return 1.0 / self.width

    def offset(self, value: float) -> float:
        """Return nothing: no place in the range is likelier."""
        del value
        return 0.0


@dataclass(frozen=True, kw_only=True)
class FreeParameter:
    """A free parameter of a model at its present value.

    Attributes
    ----------
    name : as the model calls it
    unit : of the value; empty for a pure number
    value : where the model is linearised, or where a search begins
    transform : to the internal variable, of which all steps and derivatives are
    lower, upper : bounds of the value
    prior : None where it is flat
    longest_step : of the internal variable over which a linearisation is trusted
    symbol : for people
    """

    name: str
    unit: str = ""
    value: float
    transform: Transform = IDENTITY
    lower: float = -math.inf
    upper: float = math.inf
    prior: Prior | None = None
    longest_step: float = math.inf
    symbol: str = ""

    @property
    def label(self) -> str:
        """The symbol, or the name of what has none."""
        return self.symbol or self.name

    @property
    def internal(self) -> float:
        """The internal variable at the present value."""
        return self.transform.internal_of(self.value)

    @property
    def slope(self) -> float:
        """Derivative of the value by the internal variable at the present value."""
        return self.transform.slope(self.value)

    def at(self, value: float) -> Self:
        """Return the parameter at another value, kept within the bounds."""
        return replace(self, value=min(max(value, self.lower), self.upper))

    def after(self, step: float) -> Self:
        """Return the parameter after a step of its internal variable, kept within the bounds."""
        return self.at(self.transform.value_of(self.internal + step))

    @property
    def prior_precision(self) -> float:
        """Inverse of the prior's deviation, internal units; 0 where the prior is flat."""
        return 0.0 if self.prior is None else self.prior.precision(self.slope)

    @property
    def prior_scale(self) -> float:
        """The prior's deviation, internal units; infinite where it is flat."""
        return 1.0 / self.prior_precision if self.prior_precision > 0 else math.inf

    @property
    def prior_offset(self) -> float:
        """By how many deviations of its prior it stands off the prior's mean; 0 where the prior is flat."""
        return 0.0 if self.prior is None else self.prior.offset(self.value)

    @property
    def pulled_to_null(self) -> bool:
        """Whether its prior has a place to which it pulls: that of an amplitude, no range."""
        return isinstance(self.prior, NormalPrior)

    @property
    def limits(self) -> tuple[float, float]:
        """The bounds as steps (lower, upper) of the internal variable from here."""
        low = self.transform.internal_of(self.lower) if math.isfinite(self.lower) else -math.inf
        high = self.transform.internal_of(self.upper) if math.isfinite(self.upper) else math.inf
        return low - self.internal, high - self.internal

    @property
    def reach(self) -> tuple[float, float]:
        """The steps (lower, upper) within the bounds over which a linearisation is trusted."""
        low, high = self.limits
        return max(low, -self.longest_step), min(high, self.longest_step)


def prior_information(free: Sequence[FreeParameter]) -> FloatArray:
    """Return the information (p, p) that the priors give on the internal variables."""
    return np.diag([parameter.prior_precision**2 for parameter in free])
