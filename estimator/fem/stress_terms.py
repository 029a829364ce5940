"""What terms that add a stress to the tissue's own share: parts of that stress, and tangents.

A second Piola–Kirchhoff stress S adds the nodal forces of P = F S. While it is frozen its tangent is the geometric
stiffness; what it changes with the strain adds products of first Piola–Kirchhoff stresses (Bonet & Wood, "Nonlinear
Continuum Mechanics for Finite Element Analysis", 2nd ed., section 9.4).
"""

import numpy as np
from numpy.typing import NDArray

from estimator.fem.body import Body, Response
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]


def shear_energy(material: Material, response: Response) -> FloatArray:
    """Return the density (e, q), J/m³, of the energy that Lamé's μ weighs."""
    return material.lame[0] * response.law.value.reshape(response.dilatation.shape)


def shear_slope(material: Material, response: Response) -> FloatArray:
    """Return the derivatives (3, e, q) of :func:`shear_energy` by I1, I2 and J."""
    return material.lame[0] * response.law.first.reshape(response.slope.shape)


def shear_curvature(material: Material, response: Response) -> FloatArray:
    """Return the second derivatives (6, e, q) of :func:`shear_energy` by I1I1, I1I2, I1J, I2I2, I2J, JJ."""
    return material.lame[0] * response.law.second.reshape(6, *response.dilatation.shape)


def second_piola(F: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the second Piola–Kirchhoff stress (e, q, 3, 3), Pa, of energy slopes (3, e, q) by I1, I2 and J."""
    c = np.swapaxes(F, -1, -2) @ F
    trace = np.trace(c, axis1=-2, axis2=-1)[..., None, None]
    jacobian = np.linalg.det(F)[..., None, None]
    first, second, third = slope[..., None, None]
    identity = np.eye(3)
    return np.asarray(
        2 * first * identity + 2 * second * (trace * identity - c) + third * jacobian * np.linalg.inv(c)
    )


def green_lagrange(F: FloatArray) -> FloatArray:
    """Return the Green–Lagrange strain ½(FᵀF − 1), (e, q, 3, 3)."""
    return np.asarray(0.5 * (np.swapaxes(F, -1, -2) @ F - np.eye(3)))


def geometric_stiffness(body: Body, stress: FloatArray) -> FloatArray:
    """Return the stiffness (e, 3k, 3k) of a frozen second Piola–Kirchhoff stress (e, q, 3, 3), Pa."""
    count, rule, nodes, _ = body.gradient.shape
    pulled = (body.gradient @ stress) * body.volume[:, :, None, None]
    left = pulled.transpose(0, 2, 1, 3).reshape(count, nodes, 3 * rule)
    right = body.gradient.transpose(0, 1, 3, 2).reshape(count, 3 * rule, nodes)
    out = np.zeros((count, nodes, 3, nodes, 3))
    of_one_axis = left @ right
    for axis in range(3):
        out[:, :, axis, :, axis] = of_one_axis
    return out.reshape(count, 3 * nodes, 3 * nodes)


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
