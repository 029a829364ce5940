"""A material: a law with its parameters."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

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
