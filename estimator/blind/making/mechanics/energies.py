"""Further energies: powers of stretches, quadratic forms of strain, and curves of an invariant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.mechanics.laws import Curve, InvertedError

FloatArray = NDArray[np.float64]

_PLACE = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
_I, _J = np.array([0, 1, 2, 0, 1, 0]), np.array([0, 1, 2, 1, 2, 2])
# Squares of stretches that differ by less than this share are one.
_EQUAL = 1e-6


@dataclass(frozen=True, slots=True)
class Stretches:
    """Ogden's law (1972) in place of a share of the baseline's shear energy.

    Σ wk Σi [(2/αk²) (λi^αk − 1 − αk ln λi) − ½ (λi² − 1 − 2 ln λi)]: it leaves E and ν at small strain as they are.

    Attributes
    ----------
    exponents : αk
    weights : wk
    """

    exponents: tuple[float, ...]
    weights: tuple[float, ...]

    def __call__(self, C: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return energy, stress and tangent, as :class:`~.laws.Addition` says."""
        squares, vectors = np.linalg.eigh(C[:, _PLACE])
        if not np.all(squares > 1e-6):
            raise InvertedError("material is turned inside out")
        energy, first, second = (np.zeros_like(squares) for _ in range(3))
        for exponent, weight in zip(self.exponents, self.weights, strict=True):
            for power, sign in ((exponent, weight), (2.0, -weight)):
                grown, scale = squares ** (power / 2), sign * 2 / power**2
                energy += scale * (grown - 1 - power / 2 * np.log(squares))
                first += scale * power / 2 * (grown - 1) / squares
                second += scale * power / 2 * ((power / 2 - 1) * grown + 1) / squares**2
        S, D = np.zeros_like(C), np.zeros((len(C), 6, 6))
        for i in range(3):
            own = _dyads(vectors[:, :, i], vectors[:, :, i])
            S += 2 * first[:, i, None] * own
            D += 4 * second[:, i, None, None] * own[:, :, None] * own[:, None, :]
            for j in range(i):
                mixed = _dyads(vectors[:, :, i], vectors[:, :, j])
                apart = squares[:, i] - squares[:, j]
                alike = np.abs(apart) < _EQUAL * squares[:, i]
                slope = np.where(
                    alike,
                    (second[:, i] + second[:, j]) / 2,
                    (first[:, i] - first[:, j]) / np.where(alike, 1.0, apart),
                )
                D += 8 * slope[:, None, None] * mixed[:, :, None] * mixed[:, None, :]
        return energy.sum(axis=1), S, D


@dataclass(frozen=True)
class TransverselyIsotropic:
    """Small-strain stiffness of a fibre direction, of Green-Lagrange's strain (Saint Venant and Kirchhoff's kind).

    ½ [along (a·E a)² + 2 coupled (a·E a) tr E + shear 2 |E a|²], over the shear modulus.

    Attributes
    ----------
    direction : a, of unit length
    along, coupled, shear : over the shear modulus
    """

    direction: tuple[float, float, float]
    along: float
    coupled: float = 0.0
    shear: float = 0.0

    def __call__(self, C: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return energy, stress and tangent, as :class:`~.laws.Addition` says."""
        a = np.asarray(self.direction)
        unit = np.eye(3)
        dyad = np.outer(a, a)
        pulled = np.einsum("ik,j,l->ijkl", unit, a, a)
        pulled = sum(np.transpose(pulled, order) for order in _SYMMETRIES) / len(_SYMMETRIES)
        tensor = self.along * np.multiply.outer(dyad, dyad) + 2 * self.shear * pulled
        tensor = tensor + self.coupled * (np.multiply.outer(dyad, unit) + np.multiply.outer(unit, dyad))
        D = tensor[_I[:, None], _J[:, None], _I, _J]
        strain = (C - np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])) / 2 * np.array([1, 1, 1, 2, 2, 2])
        S = strain @ D
        return (S * strain).sum(axis=1) / 2, S, np.broadcast_to(D, (len(C), 6, 6))


# What may be exchanged in a tensor (i, j, k, l) that takes a symmetric tensor to one.
_SYMMETRIES = ((0, 1, 2, 3), (1, 0, 2, 3), (0, 1, 3, 2), (1, 0, 3, 2))


def _dyads(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return ½ (a ⊗ b + b ⊗ a) of vectors (n, 3), as (n, 6)."""
    return (a[:, _I] * b[:, _J] + a[:, _J] * b[:, _I]) / 2


def power_of_invariant(exponent: float) -> Curve:
    """3^(1−α)/α ((3 + y)^α − 3^α) − y (Lopez-Pamies 2010)."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        grown = np.maximum(3 + y, 1e-9) / 3
        first = grown ** (exponent - 1)
        return (
            3 / exponent * (grown**exponent - 1) - y,
            first - 1,
            (exponent - 1) / 3 * grown ** (exponent - 2),
        )

    return curve


def hardening(rate: float, exponent: float) -> Curve:
    """1/b [(1 + b y/n)^n − 1] − y (Knowles 1977)."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        base = np.maximum(1 + rate * y / exponent, 1e-9)
        first = base ** (exponent - 1)
        second = rate * (exponent - 1) / exponent * base ** (exponent - 2)
        return (base**exponent - 1) / rate - y, first - 1, second

    return curve


def recruited(beyond: float) -> Curve:
    """(y − y₀)³/y₀ where y > y₀: fibres that are crimped before, the toe of soft tissue (Fung 1993)."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        taut = np.maximum(y - beyond, 0.0)
        return taut**3 / beyond, 3 * taut**2 / beyond, 6 * taut / beyond

    return curve


def root() -> Curve:
    """2 √3 (√(3 + y) − √3): the root of the second invariant (Carroll 2011)."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        grown = np.sqrt(np.maximum(3 + y, 1e-9) / 3)
        return 6 * (grown - 1), 1 / grown, -1 / (6 * grown**3)

    return curve


def fading(range_: float) -> Curve:
    """γ ln(1 + y/γ): a logarithm that fades sooner than Gent and Thomas's, for γ < 3 (Alexander 1968)."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        grown = np.maximum(1 + y / range_, 1e-9)
        return range_ * np.log(grown), 1 / grown, -1 / (range_ * grown**2)

    return curve


def both_ways(rate: float) -> Curve:
    """(exp(rate·y²) − 1)/rate: fibres that bear compression as they bear tension (Holzapfel, Gasser and Ogden 2000)."""

    def curve(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        grown = np.exp(np.minimum(rate * y**2, 100.0))
        return (grown - 1) / rate, 2 * y * grown, (2 + 4 * rate * y**2) * grown

    return curve
