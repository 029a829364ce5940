"""The loops over a given stress, compiled: stresses of energy slopes, and the forces and stiffness of a frozen stress.

With C = FᵀF and the cofactor of F, the second Piola–Kirchhoff stress of energy slopes W1, W2, W3 by I1, I2 and J is
S = 2 W1 1 + 2 W2 (I1 1 − C) + W3 J C⁻¹, where J C⁻¹ = cof Fᵀ cof F / J (Bonet & Wood, "Nonlinear Continuum Mechanics
for Finite Element Analysis", 2nd ed., section 6.2).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from estimator.fem.assembly.kernels import cofactor

FloatArray = NDArray[np.float64]


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def second_piola(F: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the second Piola–Kirchhoff stress (e, q, 3, 3), Pa, of energy slopes (3, e, q) by I1, I2 and J."""
    count, rule = F.shape[:2]
    out = np.empty((count, rule, 3, 3))
    c, cof = np.empty((3, 3)), np.empty((3, 3))
    for e in range(count):
        for q in range(rule):
            f = F[e, q]
            cofactor(f, cof)
            for i in range(3):
                for j in range(3):
                    c[i, j] = f[0, i] * f[0, j] + f[1, i] * f[1, j] + f[2, i] * f[2, j]
            jacobian = f[0, 0] * cof[0, 0] + f[0, 1] * cof[0, 1] + f[0, 2] * cof[0, 2]
            first, second, third = slope[0, e, q], slope[1, e, q], slope[2, e, q] / jacobian
            spherical = 2.0 * first + 2.0 * second * (c[0, 0] + c[1, 1] + c[2, 2])
            for i in range(3):
                for j in range(3):
                    inverse = cof[0, i] * cof[0, j] + cof[1, i] * cof[1, j] + cof[2, i] * cof[2, j]
                    out[e, q, i, j] = third * inverse - 2.0 * second * c[i, j]
                out[e, q, i, i] += spherical
    return out


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def first_piola(F: FloatArray, stress: FloatArray) -> FloatArray:
    """Return the first Piola–Kirchhoff stress F S (e, q, 3, 3), Pa, of a second one S (e, q, 3, 3), Pa."""
    count, rule = F.shape[:2]
    out = np.empty((count, rule, 3, 3))
    for e in range(count):
        for q in range(rule):
            f, s = F[e, q], stress[e, q]
            for i in range(3):
                for j in range(3):
                    out[e, q, i, j] = f[i, 0] * s[0, j] + f[i, 1] * s[1, j] + f[i, 2] * s[2, j]
    return out


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def element_forces_of_stress(stress: FloatArray, gradient: FloatArray, volume: FloatArray) -> FloatArray:
    """Return the internal force of each element (e, k, 3), N, of a first Piola–Kirchhoff stress (e, q, 3, 3), Pa.

    ``gradient`` (e, q, k, 3) holds the material shape gradients, 1/m, ``volume`` (e, q) quadrature weight times
    reference volume, m³.
    """
    count, rule, nodes, _ = gradient.shape
    out = np.zeros((count, nodes, 3))
    for e in range(count):
        for q in range(rule):
            p, dv = stress[e, q], volume[e, q]
            for a in range(nodes):
                g0, g1, g2 = dv * gradient[e, q, a, 0], dv * gradient[e, q, a, 1], dv * gradient[e, q, a, 2]
                for i in range(3):
                    out[e, a, i] += p[i, 0] * g0 + p[i, 1] * g1 + p[i, 2] * g2
    return out


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def element_geometric_stiffness(stress: FloatArray, gradient: FloatArray, volume: FloatArray) -> FloatArray:
    """Return the stiffness (e, 3k, 3k), N/m, of a frozen second Piola–Kirchhoff stress (e, q, 3, 3), Pa.

    Only the lower triangle is filled. The same number stands for all three axes: it is summed once for each pair
    of nodes. ``gradient`` and ``volume`` as for :func:`element_forces_of_stress`.
    """
    count, rule, nodes, _ = gradient.shape
    out = np.zeros((count, 3 * nodes, 3 * nodes))
    of_one_axis = np.empty((nodes, nodes))
    for e in range(count):
        of_one_axis[:] = 0.0
        for q in range(rule):
            s, dv = stress[e, q], volume[e, q]
            for a in range(nodes):
                g = gradient[e, q, a]
                t0 = dv * (s[0, 0] * g[0] + s[0, 1] * g[1] + s[0, 2] * g[2])
                t1 = dv * (s[1, 0] * g[0] + s[1, 1] * g[1] + s[1, 2] * g[2])
                t2 = dv * (s[2, 0] * g[0] + s[2, 1] * g[1] + s[2, 2] * g[2])
                for b in range(a + 1):
                    h = gradient[e, q, b]
                    of_one_axis[a, b] += t0 * h[0] + t1 * h[1] + t2 * h[2]
        for a in range(nodes):
            for b in range(a + 1):
                for i in range(3):
                    out[e, 3 * a + i, 3 * b + i] = of_one_axis[a, b]
    return out
