"""A material: a law with its parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.materials.law import Law

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Material:
    """A law with small-strain Young's modulus (Pa), Poisson's ratio and its shape parameters (k,)."""

    law: Law
    youngs_modulus: float
    poisson_ratio: float
    shape: FloatArray = field(default_factory=lambda: np.zeros(0))

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's μ and λ, Pa: μ = E / 2(1 + ν), λ = Eν / (1 + ν)(1 − 2ν)."""
        e, nu = self.youngs_modulus, self.poisson_ratio
        return e / (2 * (1 + nu)), e * nu / ((1 + nu) * (1 - 2 * nu))

    @property
    def lame_derivatives(self) -> dict[str, tuple[float, float]]:
        """Derivatives (of μ, of λ) by Young's modulus and by Poisson's ratio."""
        e, nu = self.youngs_modulus, self.poisson_ratio
        mu, lame = self.lame
        by_nu = e * (1 + 2 * nu**2) / ((1 + nu) * (1 - 2 * nu)) ** 2
        return {"youngs_modulus": (mu / e, lame / e), "poisson_ratio": (-mu / (1 + nu), by_nu)}


def make_material(
    law: Law, youngs_modulus: float, poisson_ratio: float, shape: Sequence[float] = ()
) -> Material:
    """Return a checked material; shape parameters that are not given are at their null.

    Raises
    ------
    InputError
        A value is outside its range.
    """
    if not (youngs_modulus > 0 and -1 < poisson_ratio < 0.5):
        raise InputError(
            f"E = {youngs_modulus:g} Pa, nu = {poisson_ratio:g}: E must be positive and nu between -1 and 0.5"
        )
    names = [parameter.name for parameter in law.shape_parameters]
    if len(shape) > len(names):
        raise InputError(
            f"{law.name} has {len(names)} shape parameters ({', '.join(names)}), not {len(shape)}"
        )
    values = [*shape, *(parameter.null for parameter in law.shape_parameters[len(shape) :])]
    for parameter, value in zip(law.shape_parameters, values, strict=True):
        if not parameter.lower <= value <= parameter.upper:
            raise InputError(
                f"{parameter.name} = {value:g} of {law.name} is outside [{parameter.lower:g}, {parameter.upper:g}]"
            )
    return Material(law, youngs_modulus, poisson_ratio, np.array(values, dtype=np.float64))
