"""The element loops, compiled: kinematics, internal forces and tangent stiffness.

They run on one thread: an element loop takes milliseconds, and where another process holds the second core a parallel
loop waits for it at every barrier, which costs more than that core ever gives.

First Piola–Kirchhoff stress and tangent follow from the energy W(I1, I2, J) by the chain rule (Bonet & Wood,
"Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., ch. 5 and 8):

    P = Σ_i W_i G_i,   A = Σ_ij W_ij G_i ⊗ G_j + Σ_i W_i ∂G_i/∂F,
    G_1 = 2F,   G_2 = 2(I1 F − F C),   G_3 = cof F.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class ProjectedDilatation(NamedTuple):
    """What resists a change of volume that is projected in each element (a named tuple, which numba can unpack).

    The dilatation θ adds Σ_r bulk_e (∂b_r/∂u)(∂b_r/∂u)ᵀ to the stiffness, with b_r = ∫ basis_r θ dV.

    Attributes
    ----------
    basis : (e, q, r), functions that are orthonormal in each element
    bulk : (e,), Pa
    by : derivatives of θ by I1, I2 and J
    """

    basis: FloatArray
    bulk: FloatArray
    by: tuple[float, float, float]


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def deformation_gradient(displacement: FloatArray, cells: IntArray, gradient: FloatArray) -> FloatArray:
    """Return F (e, q, 3, 3) from nodal displacements (n, 3) and material shape gradients (e, q, k, 3)."""
    count, rule, nodes, _ = gradient.shape
    out = np.empty((count, rule, 3, 3))
    u = np.empty((nodes, 3))
    # Nine sums in registers over nodes side by side take a quarter of the time of one sum after the other.
    for e in range(count):
        for a in range(nodes):
            for i in range(3):
                u[a, i] = displacement[cells[e, a], i]
        for q in range(rule):
            f00 = f11 = f22 = 1.0
            f01 = f02 = f10 = f12 = f20 = f21 = 0.0
            for a in range(nodes):
                g0, g1, g2 = gradient[e, q, a, 0], gradient[e, q, a, 1], gradient[e, q, a, 2]
                u0, u1, u2 = u[a, 0], u[a, 1], u[a, 2]
                f00 += u0 * g0
                f01 += u0 * g1
                f02 += u0 * g2
                f10 += u1 * g0
                f11 += u1 * g1
                f12 += u1 * g2
                f20 += u2 * g0
                f21 += u2 * g1
                f22 += u2 * g2
            F = out[e, q]
            F[0, 0], F[0, 1], F[0, 2] = f00, f01, f02
            F[1, 0], F[1, 1], F[1, 2] = f10, f11, f12
            F[2, 0], F[2, 1], F[2, 2] = f20, f21, f22
    return out


@njit(cache=True)
def cofactor(F: FloatArray, out: FloatArray) -> None:
    """Fill out (3, 3) with the cofactor J F⁻ᵀ of F (3, 3)."""
    for i in range(3):
        for j in range(3):
            i1, i2, j1, j2 = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            out[i, j] = F[i1, j1] * F[i2, j2] - F[i1, j2] * F[i2, j1]


@njit(cache=True)
def invariants(F: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return I1, I2 and J, each (e, q), of deformation gradients (e, q, 3, 3)."""
    count, rule = F.shape[:2]
    first, second, jacobian = np.empty((count, rule)), np.empty((count, rule)), np.empty((count, rule))
    for e in range(count):
        for q in range(rule):
            f = F[e, q]
            trace, square = 0.0, 0.0
            for i in range(3):
                for j in range(3):
                    trace += f[i, j] * f[i, j]
                    c = f[0, i] * f[0, j] + f[1, i] * f[1, j] + f[2, i] * f[2, j]
                    square += c * c
            first[e, q] = trace
            second[e, q] = 0.5 * (trace * trace - square)
            jacobian[e, q] = (
                f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
                - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
                + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
            )
    return first, second, jacobian


@njit(cache=True)
def _invariant_gradients(F: FloatArray, G: FloatArray) -> None:
    """Fill G (3, 3, 3) with the derivatives of I1, I2 and J by F."""
    trace = 0.0
    for i in range(3):
        for j in range(3):
            trace += F[i, j] * F[i, j]
    cofactor(F, G[2])
    for i in range(3):
        for j in range(3):
            fc = 0.0
            for m in range(3):
                fc += F[i, m] * (F[0, m] * F[0, j] + F[1, m] * F[1, j] + F[2, m] * F[2, j])
            G[0, i, j] = 2.0 * F[i, j]
            G[1, i, j] = 2.0 * (trace * F[i, j] - fc)


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def dilatation_rate(
    F: FloatArray,
    cells: IntArray,
    gradient: FloatArray,
    change: FloatArray,
    by: tuple[float, float, float],
) -> FloatArray:
    """Return the first-order change (e, q) of the dilatation for a change of the nodal displacements (n, 3).

    ``by`` holds the dilatation's derivatives by I1, I2 and J.
    """
    count, rule, nodes, _ = gradient.shape
    out = np.empty((count, rule))
    G = np.empty((3, 3, 3))
    for e in range(count):
        for q in range(rule):
            _invariant_gradients(F[e, q], G)
            total = 0.0
            for i in range(3):
                s0 = by[0] * G[0, i, 0] + by[1] * G[1, i, 0] + by[2] * G[2, i, 0]
                s1 = by[0] * G[0, i, 1] + by[1] * G[1, i, 1] + by[2] * G[2, i, 1]
                s2 = by[0] * G[0, i, 2] + by[1] * G[1, i, 2] + by[2] * G[2, i, 2]
                for a in range(nodes):
                    g = gradient[e, q, a]
                    total += (s0 * g[0] + s1 * g[1] + s2 * g[2]) * change[cells[e, a], i]
            out[e, q] = total
    return out


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def element_forces(F: FloatArray, gradient: FloatArray, volume: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the internal force of each element (e, k, 3).

    ``volume`` (e, q) holds quadrature weight times reference volume; ``slope`` (3, e, q) the energy's derivatives by
    I1, I2 and J.
    """
    count, rule, nodes, _ = gradient.shape
    out = np.zeros((count, nodes, 3))
    G, P = np.empty((3, 3, 3)), np.empty((3, 3))
    for e in range(count):
        force = out[e]
        for q in range(rule):
            _invariant_gradients(F[e, q], G)
            dv = volume[e, q]
            w0, w1, w2 = dv * slope[0, e, q], dv * slope[1, e, q], dv * slope[2, e, q]
            for i in range(3):
                for j in range(3):
                    P[i, j] = w0 * G[0, i, j] + w1 * G[1, i, j] + w2 * G[2, i, j]
            p00, p01, p02 = P[0, 0], P[0, 1], P[0, 2]
            p10, p11, p12 = P[1, 0], P[1, 1], P[1, 2]
            p20, p21, p22 = P[2, 0], P[2, 1], P[2, 2]
            for a in range(nodes):
                g0, g1, g2 = gradient[e, q, a, 0], gradient[e, q, a, 1], gradient[e, q, a, 2]
                force[a, 0] += p00 * g0 + p01 * g1 + p02 * g2
                force[a, 1] += p10 * g0 + p11 * g1 + p12 * g2
                force[a, 2] += p20 * g0 + p21 * g1 + p22 * g2
    return out


@njit(cache=True)
def _elasticity(
    F: FloatArray, G: FloatArray, w: FloatArray, h: FloatArray, strains: FloatArray, A: FloatArray
) -> None:
    """Fill A (9, 9), the derivative of P by F, from first (3,) and second (6,) derivatives of the energy.

    F Fᵀ and Fᵀ F are left in ``strains`` (2, 3, 3).
    """
    b, c = strains[0], strains[1]
    trace = 0.0
    for i in range(3):
        for j in range(3):
            trace += F[i, j] * F[i, j]
            b[i, j] = F[i, 0] * F[j, 0] + F[i, 1] * F[j, 1] + F[i, 2] * F[j, 2]
            c[i, j] = F[0, i] * F[0, j] + F[1, i] * F[1, j] + F[2, i] * F[2, j]
    for i in range(3):
        for j in range(3):
            g1, g2, g3 = G[0, i, j], G[1, i, j], G[2, i, j]
            a1 = h[0] * g1 + h[1] * g2 + h[2] * g3
            a2 = h[1] * g1 + h[3] * g2 + h[4] * g3
            a3 = h[2] * g1 + h[4] * g2 + h[5] * g3
            for k in range(3):
                for l in range(3):  # noqa: E741 - i, j, k, l are the indices of the tangent
                    value = a1 * G[0, k, l] + a2 * G[1, k, l] + a3 * G[2, k, l]
                    value += w[1] * (4.0 * F[i, j] * F[k, l] - 2.0 * F[i, l] * F[k, j])
                    if i == k:
                        value -= 2.0 * w[1] * c[j, l]
                    if j == l:
                        value -= 2.0 * w[1] * b[i, k]
                        if i == k:
                            value += 2.0 * w[0] + 2.0 * w[1] * trace
                    if i != k and j != l:
                        m, n = 3 - i - k, 3 - j - l
                        sign = 1.0 if ((k - i) % 3 == 1) == ((l - j) % 3 == 1) else -1.0
                        value += w[2] * sign * F[m, n]
                    A[3 * i + j, 3 * k + l] = value


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def element_stiffness(
    F: FloatArray,
    gradient: FloatArray,
    volume: FloatArray,
    slope: FloatArray,
    curvature: FloatArray,
    dilatation: ProjectedDilatation,
) -> FloatArray:
    """Return the tangent stiffness of each element, (e, 3k, 3k), lower triangle filled.

    ``curvature`` (6, e, q) holds the energy's second derivatives by I1I1, I1I2, I1J, I2I2, I2J, JJ. ``dilatation`` is
    what a projected dilatation adds.
    """
    basis, bulk, by = dilatation
    count, rule, nodes, _ = gradient.shape
    modes = basis.shape[2]
    size = 3 * nodes
    out = np.zeros((count, size, size))
    G, A, T, rate = np.empty((3, 3, 3)), np.empty((9, 9)), np.empty((9, size)), np.empty((3, 3))
    w, h, strains = np.empty(3), np.empty(6), np.empty((2, 3, 3))
    D = np.empty((modes, size))
    for e in range(count):
        D[:] = 0.0
        K = out[e]
        for q in range(rule):
            dv = volume[e, q]
            for n in range(3):
                w[n] = slope[n, e, q] * dv
            for n in range(6):
                h[n] = curvature[n, e, q] * dv
            _invariant_gradients(F[e, q], G)
            _elasticity(F[e, q], G, w, h, strains, A)
            for i in range(3):
                for j in range(3):
                    rate[i, j] = dv * (by[0] * G[0, i, j] + by[1] * G[1, i, j] + by[2] * G[2, i, j])
            for row in range(9):
                for a in range(nodes):
                    g = gradient[e, q, a]
                    for k in range(3):
                        T[row, 3 * a + k] = (
                            A[row, 3 * k] * g[0] + A[row, 3 * k + 1] * g[1] + A[row, 3 * k + 2] * g[2]
                        )
            for a in range(nodes):
                g0, g1, g2 = gradient[e, q, a, 0], gradient[e, q, a, 1], gradient[e, q, a, 2]
                last = 3 * (a + 1)
                for i in range(3):
                    target, t0, t1, t2 = K[3 * a + i], T[3 * i], T[3 * i + 1], T[3 * i + 2]
                    for column in range(last):
                        target[column] += g0 * t0[column] + g1 * t1[column] + g2 * t2[column]
                    grown = rate[i, 0] * g0 + rate[i, 1] * g1 + rate[i, 2] * g2
                    for r in range(modes):
                        D[r, 3 * a + i] += basis[e, q, r] * grown
        for r in range(modes):
            for row in range(size):
                factor = bulk[e] * D[r, row]
                for column in range(row + 1):
                    K[row, column] += factor * D[r, column]
    return out


@njit(cache=True)
def gather(start: IntArray, source: IntArray, values: FloatArray) -> FloatArray:
    """Sum element entries into matrix entries: out[n] = Σ values[source[start[n]:start[n+1]]]."""
    out = np.empty(len(start) - 1)
    for n in range(len(out)):
        total = 0.0
        for s in range(start[n], start[n + 1]):
            total += values[source[s]]
        out[n] = total
    return out
