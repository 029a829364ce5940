"""Parameters of the fit, and the scale on which each is nearly linear."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from estimator.materials.law import Law, ShapeParameter


@dataclass(frozen=True, slots=True)
class FitParameter:
    """A material parameter with the monotone transformation under which the fit treats it.

    Attributes
    ----------
    name : as the material calls it
    lower, upper : bounds of the value
    to_internal, from_internal : the transformation and its inverse
    slope : derivative of the value by the internal variable, at a value
    start : value where a fit begins that knows no better
    symbol, unit : for people; the unit of a pure number is empty
    longest_step : of the internal variable over which a linearisation is trusted: of ln E and −ln(1 − 2ν) by default
    """

    name: str
    lower: float
    upper: float
    to_internal: Callable[[float], float]
    from_internal: Callable[[float], float]
    slope: Callable[[float], float]
    start: float = 0.0
    symbol: str = ""
    unit: str = ""
    longest_step: float = 1.5

    @property
    def label(self) -> str:
        """The symbol, or the name of what has none."""
        return self.symbol or self.name


def _itself(value: float) -> float:
    return value


def _internal_of_ratio(ratio: float) -> float:
    return -math.log(1 - 2 * ratio)


def _ratio_of_internal(internal: float) -> float:
    return (1 - math.exp(-internal)) / 2


def _slope_of_ratio(ratio: float) -> float:
    return (1 - 2 * ratio) / 2


# Every force is proportional to E, so that ln E is the natural variable.
YOUNGS_MODULUS = FitParameter(
    "youngs_modulus", 1.0, 1e9, math.log, math.exp, _itself, start=1e4, symbol="E", unit="Pa"
)

# Near one half the response depends on the bulk modulus, E / 3(1 − 2ν): −ln(1 − 2ν) is nearly linear there.
POISSON_RATIO = FitParameter(
    "poisson_ratio",
    -0.5,
    0.4999,
    _internal_of_ratio,
    _ratio_of_internal,
    _slope_of_ratio,
    start=0.4,
    symbol="ν",
)


def law_parameters(law: Law) -> tuple[FitParameter, ...]:
    """Return all parameters of a material with this law: E, ν and the shape parameters, in units of their scale."""
    return (YOUNGS_MODULUS, POISSON_RATIO, *(_of_shape(parameter) for parameter in law.shape_parameters))


def _of_shape(parameter: ShapeParameter) -> FitParameter:
    scale = parameter.scale
    return FitParameter(
        parameter.name,
        parameter.lower,
        parameter.upper,
        partial(_times, 1 / scale),
        partial(_times, scale),
        partial(_constant, scale),
        start=parameter.null,
        longest_step=10.0,
    )


def _times(factor: float, value: float) -> float:
    return factor * value


def _constant(slope: float, value: float) -> float:
    del value
    return slope
