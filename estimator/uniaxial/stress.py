"""Stress of an incompressible specimen in homogeneous tests, and whether a law is stable in them.

With λ the stretch along the load, w1 and w2 the law's derivatives by the invariants at J = 1, and μ = E/3,
the energy's derivative by λ is μ (w1 dI1/dλ + w2 dI2/dλ). In a uniaxial test it is the nominal stress

    P = 2 μ (λ − λ⁻²) (w1 + w2/λ)

(R. S. Rivlin and D. W. Saunders, Phil. Trans. R. Soc. A 243 (1951) 251). In simple shear by γ, I1 = I2 = 3 + γ² and the
shear stress is 2 μ γ (w1 + w2) (the same).
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.materials.law import Law
from estimator.materials.neo_hookean import NeoHookean
from estimator.materials.ogden import Ogden1

FloatArray = NDArray[np.float64]
_LEAST_EXPONENT = 1e-4  # below it rounding would show in the energy
_Path = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""I1, I2 and their derivatives by the stretch, along one kind of test."""


def uniaxial_stress(law: Law, youngs_modulus: float, shape: FloatArray, stretch: FloatArray) -> FloatArray:
    """Return the nominal stress (n,), Pa, at stretches (n,).

    Raises
    ------
    SolverError
        A stretch lies beyond the law's limit.
    """
    return youngs_modulus * unit_stress(law, shape, stretch)


def unit_stress(law: Law, shape: FloatArray, stretch: FloatArray) -> FloatArray:
    """Return the nominal stress over Young's modulus (n,) of a uniaxial test at stretches (n,).

    Raises
    ------
    SolverError
        A stretch lies beyond the law's limit.
    """
    return _slope(law, shape, _uniaxial(stretch)) / 3


def unit_stress_and_energy(
    law: Law, shape: FloatArray, where: FloatArray, test: Literal["uniaxial", "shear"]
) -> tuple[FloatArray, FloatArray]:
    """Return stress and strain energy over Young's modulus, (n,) each, at stretches, or amounts of shear, (n,).

    Raises
    ------
    SolverError
        One lies beyond the law's limit.
    """
    if isinstance(law, (NeoHookean, Ogden1)):
        return _ogden(2.0 if isinstance(law, NeoHookean) else float(shape[0]), where, test)
    i1, i2, i1_by_stretch, i2_by_stretch = _uniaxial(where) if test == "uniaxial" else _simple_shear(where)
    found = law.derivatives(i1, i2, np.ones_like(i1), shape)
    w1, w2, _ = found.first
    return np.asarray(w1 * i1_by_stretch + w2 * i2_by_stretch) / 3, np.asarray(found.value) / 3


def is_stable(law: Law, shape: FloatArray, largest_stretch: float) -> bool:
    """Tell whether stress grows with stretch in uniaxial, equibiaxial and planar tests.

    Each is followed, in tension and compression, as far as I1 stays below its value at ``largest_stretch``.
    """
    limit = _uniaxial(np.array([largest_stretch]))[0][0]
    stretch = np.geomspace(0.05, 20.0, 2001)
    for test in (_uniaxial, _equibiaxial, _planar):
        followed = stretch[test(stretch)[0] <= limit]
        if np.any(np.diff(_slope(law, shape, test(followed))) <= 0):
            return False
    return True


def _slope(law: Law, shape: FloatArray, path: _Path) -> FloatArray:
    i1, i2, i1_by_stretch, i2_by_stretch = path
    w1, w2, _ = law.derivatives(i1, i2, np.ones_like(i1), shape).first
    return np.asarray(w1 * i1_by_stretch + w2 * i2_by_stretch)


def _ogden(
    exponent: float, where: FloatArray, test: Literal["uniaxial", "shear"]
) -> tuple[FloatArray, FloatArray]:
    """Return stress and energy of one power of the principal stretches, which are known here.

    They are λ, λ^(-1/2) twice, or λ, 1, 1/λ with γ = λ - 1/λ. The power 2 is the Neo-Hookean law.
    """
    power = exponent if abs(exponent) > _LEAST_EXPONENT else _LEAST_EXPONENT
    if test == "uniaxial":
        stretch, across, count = where, -0.5, 2
        by_where = np.ones_like(where)
    else:
        stretch, across, count = (where + np.sqrt(where**2 + 4)) / 2, -1.0, 1
        by_where = 1 / (1 + stretch**-2)
    along, aside = stretch**power, stretch ** (across * power)
    slope = (along - aside) / stretch
    energy = along + count * aside - 1 - count
    return 2 / (3 * power) * slope * by_where, 2 / (3 * power**2) * energy


def _uniaxial(s: FloatArray) -> _Path:
    return s**2 + 2 / s, 2 * s + s**-2, 2 * (s - s**-2), 2 * (1 - s**-3)


def _equibiaxial(s: FloatArray) -> _Path:
    return 2 * s**2 + s**-4, s**4 + 2 * s**-2, 4 * (s - s**-5), 4 * (s**3 - s**-3)


def _planar(s: FloatArray) -> _Path:
    i, i_by_stretch = s**2 + 1 + s**-2, 2 * (s - s**-3)
    return i, i, i_by_stretch, i_by_stretch


def _simple_shear(g: FloatArray) -> _Path:
    return 3 + g**2, 3 + g**2, 2 * g, 2 * g
