"""Two departures from the Neo-Hookean law at once: their energies beyond it add up.

    w = w_1 + w_2 − x/2

Each law keeps the meaning of its shape parameters, and with the parameters of one at their null the other remains.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.materials.law import EnergyDerivatives, FloatArray, Law, ShapeParameter
from estimator.materials.material import Material, make_material
from estimator.materials.neo_hookean import NeoHookean

_NEO_HOOKEAN = NeoHookean()


@dataclass(frozen=True)
class Superposed:
    """w = w_1 + w_2 − x/2; parameter names carry that of their law."""

    one: Law
    other: Law

    @property
    def name(self) -> str:
        """Both names."""
        return f"{self.one.name}+{self.other.name}"

    @property
    def shape_parameters(self) -> tuple[ShapeParameter, ...]:
        """Those of the one, then those of the other."""
        laws = (self.one, self.other)
        return tuple(replace(p, name=f"{law.name}.{p.name}") for law in laws for p in law.shape_parameters)

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says."""
        count = len(self.one.shape_parameters)
        one = self.one.derivatives(i1, i2, j, shape[:count])
        other = self.other.derivatives(i1, i2, j, shape[count:])
        shared = _NEO_HOOKEAN.derivatives(i1, i2, j, np.zeros(0))
        return EnergyDerivatives(
            one.value + other.value - shared.value,
            one.first + other.first - shared.first,
            one.second + other.second - shared.second,
            np.concatenate([one.first_by_shape, other.first_by_shape]),
        )


def departing(material: Material, law: Law, shape: Sequence[float]) -> Material:
    """Return the material with the departure of ``law`` from the Neo-Hookean law added to its own.

    Raises
    ------
    InputError
        A shape parameter is outside its range.
    """
    added = make_material(law, material.youngs_modulus, material.poisson_ratio, shape)
    if not len(material.shape):
        return added
    return replace(
        added, law=Superposed(material.law, law), shape=np.concatenate([material.shape, added.shape])
    )
