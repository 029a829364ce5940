"""Hyperelastic energies by I1, I2 and J, built of the baseline and of terms that vanish at small strain.

The baseline is W = μ/2 (I1 − 3 − 2 ln J) + λ/2 (J − 1)². The other terms leave E and ν at small strain as they are.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Of a function of one argument y: its value, first and second derivative.
Curve = Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
_IDENTITY = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


class InvertedError(ArithmeticError):
    """Material is turned inside out, or beyond what its law can bear; take a smaller step."""


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument y of an energy term: the derivatives by its invariant I (I1 or I2) and by J.

    Attributes
    ----------
    invariant : 1 or 2
    y, by_i, by_j, by_ij, by_jj : (n,) each; the second derivative by I is zero
    """

    invariant: int
    y: FloatArray
    by_i: FloatArray
    by_j: FloatArray
    by_ij: FloatArray
    by_jj: FloatArray


@dataclass(frozen=True, slots=True)
class Term:
    """A weight times μ/2 times a curve of one argument ("isochoric_1", "isochoric_2" or "coupled_1")."""

    argument: str
    curve: Curve
    weight: float = 1.0


@dataclass(frozen=True, slots=True)
class Fibres:
    """Fibres about a unit direction at rest: E/8 times the weight times a curve of κ I1 + (1 − 3κ) I4 − 1.

    The dispersion κ is 0 where all fibres have that direction and 1/3 where they have none (Gasser, Ogden and
    Holzapfel 2006).
    """

    direction: tuple[float, float, float]
    curve: Curve
    weight: float
    dispersion: float = 0.0


class Addition(Protocol):
    """Energy that a law has beside what its invariants give."""

    def __call__(self, C: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return energy (n,), S (n, 6) and D = dS/dE (n, 6, 6) for C (n, 6), all over the shear modulus."""
        ...


@dataclass(frozen=True, slots=True)
class Law:
    """The baseline and what is added to it."""

    youngs_modulus: float
    poisson_ratio: float
    terms: Sequence[Term] = ()
    fibres: Sequence[Fibres] = field(default=())
    additions: Sequence[Addition] = ()

    def stress(self, C: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return energy W (n,), second Piola-Kirchhoff stress S (n, 6) and D = dS/dE (n, 6, 6) for C (n, 6).

        Raises
        ------
        InvertedError
            Somewhere C is no tensor of a deformation, or a term is beyond its limit.
        """
        mu = self.youngs_modulus / (2 * (1 + self.poisson_ratio))
        lame = 2 * mu * self.poisson_ratio / (1 - 2 * self.poisson_ratio)
        determinant, inverse = _inverse(C)
        if not np.all(determinant > 1e-6):
            raise InvertedError("material is turned inside out")
        J = np.sqrt(determinant)
        I1 = C[:, :3].sum(axis=1)
        I2 = (I1**2 - (C[:, :3] ** 2).sum(axis=1) - 2 * (C[:, 3:] ** 2).sum(axis=1)) / 2
        energy = mu / 2 * (I1 - 3 - 2 * np.log(J)) + lame / 2 * (J - 1) ** 2
        first = {1: np.full(len(J), mu / 2), 2: np.zeros(len(J))}
        by_ii = {1: np.zeros(len(J)), 2: np.zeros(len(J))}
        by_ij = {1: np.zeros(len(J)), 2: np.zeros(len(J))}
        by_j = -mu / J + lame * (J - 1)
        by_jj = mu / J**2 + lame
        for term in self.terms:
            a = _argument(term.argument, I1, I2, J)
            f, f1, f2 = (term.weight * mu / 2 * part for part in term.curve(a.y))
            energy = energy + f
            first[a.invariant] = first[a.invariant] + f1 * a.by_i
            by_j = by_j + f1 * a.by_j
            by_ii[a.invariant] = by_ii[a.invariant] + f2 * a.by_i**2
            by_ij[a.invariant] = by_ij[a.invariant] + f2 * a.by_i * a.by_j + f1 * a.by_ij
            by_jj = by_jj + f2 * a.by_j**2 + f1 * a.by_jj
        if not np.all(np.isfinite(energy)):
            raise InvertedError("the law is beyond its limit")
        N2 = I1[:, None] * _IDENTITY - C
        S = 2 * (first[1][:, None] * _IDENTITY + first[2][:, None] * N2) + (J * by_j)[:, None] * inverse
        D = 4 * (
            by_ii[1][:, None, None] * np.outer(_IDENTITY, _IDENTITY)
            + by_ii[2][:, None, None] * _outer(N2, N2)
            + first[2][:, None, None] * (np.outer(_IDENTITY, _IDENTITY) - np.diag([1, 1, 1, 0.5, 0.5, 0.5]))
        )
        for normal, mixed in ((np.broadcast_to(_IDENTITY, C.shape), by_ij[1]), (N2, by_ij[2])):
            if np.any(mixed):
                cross = _outer(normal, inverse)
                D += (2 * J * mixed)[:, None, None] * (cross + np.swapaxes(cross, 1, 2))
        D += (J**2 * by_jj + J * by_j)[:, None, None] * _outer(inverse, inverse)
        D -= (2 * J * by_j)[:, None, None] * _symmetric_product(inverse)
        for fibres in self.fibres:
            A = _structure(fibres)
            stretch = C @ (A * np.array([1, 1, 1, 2, 2, 2])) - 1
            f, f1, f2 = (fibres.weight * self.youngs_modulus / 8 * part for part in fibres.curve(stretch))
            energy = energy + f
            S = S + 2 * f1[:, None] * A
            D = D + 4 * f2[:, None, None] * np.outer(A, A)
        for addition in self.additions:
            f, f1, f2 = addition(C)
            energy, S, D = energy + mu * f, S + mu * f1, D + mu * f2
        return energy, S, D


def power(exponent: int) -> Curve:
    """A power of y."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        n = exponent
        return y**n, n * y ** (n - 1), n * (n - 1) * y ** (n - 2) if n > 1 else np.zeros_like(y)

    return curve


def exponential(rate: float) -> Curve:
    """(exp(rate·y) − 1)/rate − y, of Fung's and Demiray's kind."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        grown = np.exp(np.minimum(rate * y, 200.0))
        return (grown - 1) / rate - y, grown - 1, rate * grown

    return curve


def limited(limit: float) -> Curve:
    """−limit·ln(1 − y/limit) − y, Gent's, which locks at y = limit."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        room = np.where(y < limit, 1 - y / limit, np.nan)
        return -limit * np.log(room) - y, 1 / room - 1, 1 / (limit * room**2)

    return curve


def logarithmic() -> Curve:
    """3 ln(1 + y/3), of Gent and Thomas's second term."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        grown = 1 + y / 3
        return 3 * np.log(grown), 1 / grown, -1 / (3 * grown**2)

    return curve


def tension_only(rate: float) -> Curve:
    """(exp(rate·y²) − 1)/rate where y > 0, of Holzapfel, Gasser and Ogden; y² as the rate vanishes."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        taut = np.maximum(y, 0.0)
        grown = np.exp(rate * taut**2)
        second = np.where(y > 0, (2 + 4 * rate * taut**2) * grown, 0.0)
        return (grown - 1) / rate, 2 * taut * grown, second

    return curve


def _argument(name: str, I1: FloatArray, I2: FloatArray, J: FloatArray) -> Argument:
    zero = np.zeros_like(J)
    if name == "coupled_1":
        return Argument(1, I1 - 3 - 2 * np.log(J), zero + 1, -2 / J, zero, 2 / J**2)
    invariant, value, p = {"isochoric_1": (1, I1, 2 / 3), "isochoric_2": (2, I2, 4 / 3)}[name]
    scale = J**-p
    return Argument(
        invariant,
        value * scale - 3,
        scale,
        -p * value * scale / J,
        -p * scale / J,
        p * (p + 1) * value * scale / J**2,
    )


def _inverse(C: FloatArray) -> tuple[FloatArray, FloatArray]:
    xx, yy, zz, xy, yz, xz = C.T
    cofactors = np.stack(
        [
            yy * zz - yz**2,
            xx * zz - xz**2,
            xx * yy - xy**2,
            xz * yz - xy * zz,
            xy * xz - xx * yz,
            xy * yz - xz * yy,
        ],
        axis=1,
    )
    determinant = xx * cofactors[:, 0] + xy * cofactors[:, 3] + xz * cofactors[:, 5]
    with np.errstate(divide="ignore", invalid="ignore"):
        return determinant, cofactors / determinant[:, None]


def _outer(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[:, :, None] * b[:, None, :]


def _symmetric_product(inverse: FloatArray) -> FloatArray:
    """−dC⁻¹/dC by Voigt's strains: ½(C⁻¹ik C⁻¹jl + C⁻¹il C⁻¹jk)."""
    place = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
    tensor = inverse[:, place]
    i, j = np.array([0, 1, 2, 0, 1, 0]), np.array([0, 1, 2, 1, 2, 2])
    straight = tensor[:, i[:, None], i] * tensor[:, j[:, None], j]
    crossed = tensor[:, i[:, None], j] * tensor[:, j[:, None], i]
    return (straight + crossed) / 2


def _structure(fibres: Fibres) -> FloatArray:
    a = np.asarray(fibres.direction)
    dyad = np.array([a[0] ** 2, a[1] ** 2, a[2] ** 2, a[0] * a[1], a[1] * a[2], a[0] * a[2]])
    return fibres.dispersion * _IDENTITY + (1 - 3 * fibres.dispersion) * dyad
