"""The parameters of a material, and the scale on which each is nearly linear."""

import math
from collections.abc import Mapping
from types import MappingProxyType

from estimator.inference.free_parameter import (
    LOGARITHM,
    FreeParameter,
    InternalPrior,
    Transform,
    in_units_of,
)
from estimator.materials.law import Law, ShapeParameter

# Of ln E and −ln(1 − 2ν), over which a linearisation is trusted.
_LONGEST_STEP = 1.5
_LONGEST_STEP_OF_SHAPE = 10.0
# A first step where ν is not determined may lead anywhere: the exponential must still be a number.
_LARGEST_EXPONENT = 700.0


def _internal_of_ratio(ratio: float) -> float:
    return -math.log(1 - 2 * ratio)


def _ratio_of_internal(internal: float) -> float:
    return (1 - math.exp(min(-internal, _LARGEST_EXPONENT))) / 2


def _slope_of_ratio(ratio: float) -> float:
    return (1 - 2 * ratio) / 2


# Every force is proportional to E, so that ln E is the natural variable.
YOUNGS_MODULUS = FreeParameter(
    name="youngs_modulus",
    unit="Pa",
    value=1e4,
    transform=LOGARITHM,
    lower=1.0,
    upper=1e9,
    longest_step=_LONGEST_STEP,
    symbol="E",
)

# Near one half the response depends on the bulk modulus, E / 3(1 − 2ν): −ln(1 − 2ν) is nearly linear there.
POISSON_RATIO = FreeParameter(
    name="poisson_ratio",
    value=0.4,
    transform=Transform(_internal_of_ratio, _ratio_of_internal, _slope_of_ratio),
    lower=-0.5,
    upper=0.4999,
    longest_step=_LONGEST_STEP,
    symbol="ν",
)

# Soft tissue, which is mostly water (Y. C. Fung, Biomechanics, 2nd ed. 1993), gels and elastomers have mostly 0.4 to
# 0.5: two thirds of this prior lie between 0.40 and 0.491, nineteen twentieths between 0.18 and 0.497. It is so wide
# that it moves no value that measurements determine, and keeps one that they do not from running to a bound.
USUAL_RATIO = InternalPrior(0.47, 1.2, _internal_of_ratio)
USUAL_PRIORS: Mapping[str, InternalPrior] = MappingProxyType({POISSON_RATIO.name: USUAL_RATIO})


def law_parameters(law: Law) -> tuple[FreeParameter, ...]:
    """Return all parameters of a material with this law, at values where a search begins that knows no better.

    They are E, ν and the shape parameters, these in units of their scale.
    """
    return (YOUNGS_MODULUS, POISSON_RATIO, *(_of_shape(parameter) for parameter in law.shape_parameters))


def _of_shape(parameter: ShapeParameter) -> FreeParameter:
    return FreeParameter(
        name=parameter.name,
        value=parameter.null,
        transform=in_units_of(parameter.scale),
        lower=parameter.lower,
        upper=parameter.upper,
        longest_step=_LONGEST_STEP_OF_SHAPE,
    )
