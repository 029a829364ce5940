"""Knowles' power law: how fast stress grows with the first invariant, and how that growth goes on, each by a number.

    ∂w/∂x = ½ (1 + q a x)^(1/q),      w = ((1 + q a x)^(1 + 1/q) − 1) / (2 a (1 + q))

At J = 1 this is W = μ/(2b) [(1 + b (I1 − 3)/n)ⁿ − 1] with n = 1 + 1/q and b = a (1 + q). Whatever q is, a tells how the
stress departs at first; q tells how it goes on: a straight line at q = 1, Yeoh's law of two terms; an exponential at
q = 0, that of Fung and Demiray; a limit at x = −1/(q a) for q < 0, that of Gent at q = −1.
Source: J. K. Knowles, Int. J. Fracture 13 (1977) 611.
"""

import numpy as np

from estimator.errors import SolverError
from estimator.materials.invariants import ModifiedInvariants
from estimator.materials.law import EnergyDerivatives, FloatArray, ShapeParameter

# Nearer to these q the energy is that at them, to within 1e-5 of it.
_NEAR = 1e-6
_LARGEST_EXPONENT = 100.0


class Knowles:
    """∂w/∂x = ½ (1 + q a x)^(1/q)."""

    name = "knowles"
    shape_parameters = (
        ShapeParameter("rate", null=0.0, lower=0.0, upper=10.0, scale=0.2),
        ShapeParameter("course", null=0.0, lower=-3.0, upper=2.0, scale=1.0),
    )

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says.

        Raises
        ------
        SolverError
            Somewhere x reaches the limit −1/(q a), or the energy is too large for a number to hold.
        """
        rate, course = float(shape[0]), float(shape[1])
        invariants = ModifiedInvariants.of(i1, i2, j)
        x = invariants.x
        base = 1.0 + course * rate * x
        if not np.all(base > 0.0):
            raise SolverError(
                f"the deformation exceeds the limit of the Knowles law (x = {x.max():.4g}, limit "
                f"{-1.0 / (course * rate):.4g}); take a smaller step, or a larger limit"
            )
        # The logarithm of the slope's growth, and its derivatives by x and by q.
        small = abs(course) < _NEAR
        log_growth = rate * x if small else np.log(base) / course
        if np.any(log_growth > _LARGEST_EXPONENT):
            raise SolverError(
                f"the Knowles energy overflows (rate {rate:.4g}, x = {x.max():.4g}); take a smaller step"
            )
        by_course = -0.5 * (rate * x) ** 2 if small else (rate * x / base - log_growth) / course
        slope = 0.5 * np.exp(log_growth)
        return invariants.energy(
            _energy(x, rate, course, base, slope),
            first=(slope, 0.0),
            second=(slope * rate / base, 0.0, 0.0),
            first_by_shape=[(slope * x / base, 0.0), (slope * by_course, 0.0)],
        )


def _energy(x: FloatArray, rate: float, course: float, base: FloatArray, slope: FloatArray) -> FloatArray:
    """Return w (n,)."""
    if rate == 0.0:
        return x / 2
    if abs(1.0 + course) < _NEAR:
        return np.asarray(-np.log1p(-rate * x) / (2 * rate))
    # (1 + q a x)^(1 + 1/q) is base times twice the slope.
    return np.asarray((2 * slope * base - 1.0) / (2 * rate * (1.0 + course)))
