"""What terms that add a stress to the tissue's own share: parts of that stress, and tangents.

A second Piola–Kirchhoff stress S adds the nodal forces of P = F S. While it is frozen its tangent is the geometric
stiffness; what it changes with the strain adds products of first Piola–Kirchhoff stresses (Bonet & Wood, "Nonlinear
Continuum Mechanics for Finite Element Analysis", 2nd ed., section 9.4).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import Body, Response
from estimator.fem.assembly.kernels import invariants
from estimator.fem.assembly.stress_kernels import element_geometric_stiffness
from estimator.materials.law import EnergyDerivatives
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PartialEnergy:
    """A part of the tissue's energy density, J/m³, and its derivatives.

    Attributes
    ----------
    density : (e, q)
    slope : (3, e, q) by I1, I2 and J
    curvature : (6, e, q) by I1I1, I1I2, I1J, I2I2, I2J, JJ
    """

    density: FloatArray
    slope: FloatArray
    curvature: FloatArray


def shear_energy(material: Material, response: Response) -> PartialEnergy:
    """Return what Lamé's μ weighs of the energy."""
    mu, shape, law = material.lame[0], response.dilatation.shape, response.law
    return PartialEnergy(
        mu * law.value.reshape(shape), mu * law.first.reshape(3, *shape), mu * law.second.reshape(6, *shape)
    )


def whole_energy(body: Body, material: Material, response: Response) -> PartialEnergy:
    """Return the whole energy, the pressure of the projected dilatation included.

    Where the dilatation is projected its second derivative joins no point's curvature: it is that of ``bulk`` in
    :func:`estimator.fem.assembly.kernels.element_stiffness`.
    """
    shear = shear_energy(material, response)
    curvature = shear.curvature
    if not body.basis.shape[2]:
        by, (first, second) = response.law.dilatation_by, np.triu_indices(3)
        curvature = curvature + (material.lame[1] * np.take(by, first) * np.take(by, second))[:, None, None]
    return PartialEnergy(
        shear.density + 0.5 * response.pressure * response.dilatation, response.slope, curvature
    )


def isochoric_energy(material: Material, response: Response) -> PartialEnergy:
    """Return that energy at the same deformation without its change of volume, so that its stress has no pressure.

    The law's w at the invariants J^(−2/3) I1 and J^(−4/3) I2 of the isochoric part of C, and J = 1 (P. J. Flory, Trans.
    Faraday Soc. 57 (1961) 829).
    """
    at = _isochoric_invariants(material, response)
    w1, w2, a, b, p, q, j = at.w1, at.w2, at.a, at.b, at.p, at.q, at.j
    w11, w12, _, w22, _, _ = at.law.second.reshape(6, *j.shape)
    curvature = np.array(
        [
            a * a * w11,
            a * b * w12,
            a * (w11 * p + w12 * q) - 2 / 3 * a / j * w1,
            b * b * w22,
            b * (w12 * p + w22 * q) - 4 / 3 * b / j * w2,
            w11 * p * p + 2 * w12 * p * q + w22 * q * q + (-5 / 3 * p * w1 - 7 / 3 * q * w2) / j,
        ]
    )
    mu = material.lame[0]
    return PartialEnergy(mu * at.law.value.reshape(j.shape), mu * at.slope, mu * curvature)


def isochoric_slope(material: Material, response: Response) -> FloatArray:
    """Return the first derivatives (3, e, q) of that energy alone, Pa, without the cost of the others."""
    return material.lame[0] * _isochoric_invariants(material, response).slope


@dataclass(frozen=True)
class _Isochoric:
    """The law at the isochoric invariants a·I1 and b·I2: its derivatives, and theirs by J."""

    law: EnergyDerivatives
    w1: FloatArray
    w2: FloatArray
    a: FloatArray
    b: FloatArray
    p: FloatArray
    q: FloatArray
    j: FloatArray

    @property
    def slope(self) -> FloatArray:
        return np.array([self.a * self.w1, self.b * self.w2, self.p * self.w1 + self.q * self.w2])


def _isochoric_invariants(material: Material, response: Response) -> _Isochoric:
    i1, i2, j = invariants(response.F)
    a = j ** (-2 / 3)
    b = a * a
    law = material.law.derivatives((a * i1).ravel(), (b * i2).ravel(), np.ones(j.size), material.shape)
    w1, w2, _ = law.first.reshape(3, *j.shape)
    return _Isochoric(law, w1, w2, a, b, -2 / 3 * a * i1 / j, -4 / 3 * b * i2 / j, j)


def green_lagrange(F: FloatArray) -> FloatArray:
    """Return the Green–Lagrange strain ½(FᵀF − 1), (e, q, 3, 3)."""
    return np.asarray(0.5 * (np.swapaxes(F, -1, -2) @ F - np.eye(3)))


def geometric_stiffness(body: Body, stress: FloatArray) -> FloatArray:
    """Return the stiffness (e, 3k, 3k), N/m, of a frozen second Piola–Kirchhoff stress (e, q, 3, 3), Pa.

    Only the lower triangle is filled.
    """
    return element_geometric_stiffness(stress, body.gradient, body.volume)


def product_stiffness(body: Body, one: FloatArray, other: FloatArray, factor: FloatArray) -> FloatArray:
    """Return the stiffness (e, 3k, 3k) of factor · sym(one ⊗ other), the derivative of a stress P by F.

    Parameters
    ----------
    one, other : (e, q, 3, 3)
    factor : (e, q)
    """
    left = _nodal(body, one) * (factor * body.volume)[:, :, None]
    product = left.transpose(0, 2, 1) @ _nodal(body, other)
    return np.asarray(0.5 * (product + product.transpose(0, 2, 1)))


def _nodal(body: Body, stress: FloatArray) -> FloatArray:
    """Contract stresses (e, q, 3, 3) with the shape functions' gradients: (e, q, 3k)."""
    count, rule, nodes, _ = body.gradient.shape
    return (body.gradient @ stress.swapaxes(-1, -2)).reshape(count, rule, 3 * nodes)
