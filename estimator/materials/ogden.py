"""The Ogden law: powers of the principal stretches.

    w = Σ_p m_p 2/α_p² (λ1^α_p + λ2^α_p + λ3^α_p − 3 − α_p ln J),      Σ m_p = 1

With W = Σ (μ_p/α_p) (Σ λ_i^α_p − 3) at J = 1, μ_p α_p / 2 = μ m_p. One term with α = 2 is the Neo-Hookean law; two
terms with α = 2 and −2 are at J = 1 the Mooney-Rivlin law; α → 0 is Hencky's energy of the logarithmic strain.
Source: R. W. Ogden, Proc. R. Soc. A 326 (1972) 565; the term with ln J is that of its compressible form, Proc. R. Soc.
A 328 (1972) 567.
"""

from dataclasses import dataclass

import numpy as np

from estimator.materials.law import EnergyDerivatives, FloatArray, ShapeParameter
from estimator.materials.principal import ComplexArray, PrincipalSums

_SERIES_BELOW = 0.3
_POWERS = np.arange(12)
_FACTORIALS = np.cumprod(np.arange(1, 14, dtype=np.float64))  # 1!, 2!, ...


@dataclass(frozen=True, slots=True)
class _Term:
    """One exponent on the circle w = ln λ²: with t = α w/2, φ = w²/2 (eᵗ − 1 − t)/t² and φ′ = w/2 (eᵗ − 1)/t.

    Attributes
    ----------
    energy, slope, slope_by_exponent : (k, n) φ, φ′ and its derivative by α
    """

    energy: ComplexArray
    slope: ComplexArray
    slope_by_exponent: ComplexArray

    @classmethod
    def of(cls, exponent: float, log: ComplexArray) -> "_Term":
        """Evaluate the term of an exponent α, which may be zero, at w (k, n)."""
        half = log / 2
        t = exponent * half
        grown = np.expm1(t)
        by_exponent = _over_square(t, t * grown + t - grown, (_POWERS + 1) / _FACTORIALS[_POWERS + 1])
        return cls(
            2 * half**2 * _over_square(t, grown - t, 1 / _FACTORIALS[_POWERS + 1]),
            half.copy() if exponent == 0 else np.asarray(grown / exponent),
            half**2 * by_exponent,
        )


def _over_square(t: ComplexArray, numerator: ComplexArray, series: FloatArray) -> ComplexArray:
    """Return numerator / t², for small t by its power series."""
    small = np.abs(t) < _SERIES_BELOW
    quotient = numerator / np.where(small, 1.0, t) ** 2
    if small.any():
        quotient[small] = np.polynomial.polynomial.polyval(t[small], series)
    return quotient


class Ogden1:
    """One power."""

    name = "ogden1"
    shape_parameters = (ShapeParameter("exponent", null=2.0, lower=-20.0, upper=20.0, scale=0.5),)

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says."""
        sums = PrincipalSums.of(i1, i2, j, growth=abs(float(shape[0])) / 2)
        term = _Term.of(float(shape[0]), sums.log)
        return EnergyDerivatives(
            sums.value(term.energy),
            sums.first(term.slope),
            sums.second(term.slope),
            sums.first(term.slope_by_exponent)[None],
        )


class Ogden2:
    """Two powers, one positive and one negative; the share is the negative one's of the small-strain modulus."""

    name = "ogden2"
    shape_parameters = (
        ShapeParameter("exponent", null=2.0, lower=0.1, upper=20.0, scale=0.5),
        ShapeParameter("negative_exponent", null=-2.0, lower=-20.0, upper=-0.1, scale=0.5),
        ShapeParameter("negative_share", null=0.0, lower=-1.0, upper=1.0, scale=0.2),
    )

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points, as :class:`~estimator.materials.law.Law` says."""
        sums = PrincipalSums.of(i1, i2, j, growth=float(np.abs(shape[:2]).max()) / 2)
        share = float(shape[2])
        one, other = (_Term.of(float(exponent), sums.log) for exponent in shape[:2])
        first, second = sums.first(one.slope), sums.first(other.slope)
        return EnergyDerivatives(
            (1 - share) * sums.value(one.energy) + share * sums.value(other.energy),
            (1 - share) * first + share * second,
            (1 - share) * sums.second(one.slope) + share * sums.second(other.slope),
            np.stack(
                [
                    (1 - share) * sums.first(one.slope_by_exponent),
                    share * sums.first(other.slope_by_exponent),
                    second - first,
                ]
            ),
        )
