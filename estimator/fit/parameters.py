"""Parameters of the fit, and the scale on which each is nearly linear."""

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FitParameter:
    """A material parameter with the monotone transformation under which the fit treats it.

    Attributes
    ----------
    name : as the material calls it
    lower, upper : bounds of the value
    to_internal, from_internal : the transformation and its inverse
    slope : derivative of the value by the internal variable, at a value
    """

    name: str
    lower: float
    upper: float
    to_internal: Callable[[float], float]
    from_internal: Callable[[float], float]
    slope: Callable[[float], float]


def _itself(value: float) -> float:
    return value


def _internal_of_ratio(ratio: float) -> float:
    return -math.log(1 - 2 * ratio)


def _ratio_of_internal(internal: float) -> float:
    return (1 - math.exp(-internal)) / 2


def _slope_of_ratio(ratio: float) -> float:
    return (1 - 2 * ratio) / 2


# Every force is proportional to E, so that ln E is the natural variable.
YOUNGS_MODULUS = FitParameter("youngs_modulus", 1.0, 1e9, math.log, math.exp, _itself)

# Near one half the response depends on the bulk modulus, E / 3(1 − 2ν): −ln(1 − 2ν) is nearly linear there.
POISSON_RATIO = FitParameter(
    "poisson_ratio", -0.5, 0.4999, _internal_of_ratio, _ratio_of_internal, _slope_of_ratio
)
