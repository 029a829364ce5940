r"""How probable the rows of tests are under a specimen: E, zeros of the load cell and scatter of specimens integrated.

With A the stress per modulus and a constant for each test, T the prior deviations, and the covariance of the errors
C = N + s² K (N the noise, K a squared exponential along the path with a length of a third of a stroke),

    χ² = yᵀ C⁻¹ y - bᵀ M⁻¹ b,  M = Aᵀ C⁻¹ A + T⁻²,  b = Aᵀ C⁻¹ y
    ln p = -(ν + n)/2 ln(1 + χ²/ν) - ½ ln det C - ½ ln det M - ½ ln det T² - ln E

C. E. Rasmussen & C. K. I. Williams, Gaussian Processes for Machine Learning (2006), section 2.7; the noise is known
to ν rows only, which makes a Student t of it. s is integrated over a grid: what even the right model misses, and a
share of what the cause explains (M. C. Kennedy & A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from estimator.uniaxial.diagnosis.rows import Rows
from estimator.uniaxial.records import FloatArray

FLOORS = (0.0005, 0.002, 0.005)
SHARES = (0.0, 0.03, 0.08, 0.2)
UNKNOWN_AMPLITUDES = tuple(float(one) for one in np.geomspace(0.01, 0.4, 8))
_LENGTH = 0.35
_NOISE_ROWS = 20.0
_ZERO = 0.01  # of the root mean square stress
_SCATTER = 0.03  # between specimens, of the stress


@dataclass(frozen=True, slots=True)
class Fitted:
    """What is left once the linear parameters are found: log density, E (Pa), its deviation."""

    log_density: float
    modulus: float
    modulus_std: float


class Likelihood:
    """Of tests whose rows may be taken in part.

    Parameters
    ----------
    tests : all of them
    kept : for each test which rows count, (n,) of bool
    """

    def __init__(self, tests: Sequence[Rows], kept: Sequence[np.typing.NDArray[np.bool_]]) -> None:
        self.tests = [(rows, keep) for rows, keep in zip(tests, kept, strict=True)]
        self._bases = [_basis(rows, keep) for rows, keep in self.tests if keep.any()]
        self._stress = np.concatenate(
            [base @ (rows.stress[keep] / rows.noise[keep]) for (rows, keep), base in self._pairs()]
        )
        self._roughness = np.concatenate([_spectrum(rows, keep) for (rows, keep), _ in self._pairs()])
        self.rows = len(self._stress)

    def of(
        self, unit: Sequence[FloatArray], null: Sequence[FloatArray], amplitudes: Sequence[float] | None
    ) -> Fitted:
        """Return the fit of stresses per modulus, one array for each test.

        Parameters
        ----------
        null : the Neo-Hookean ones, to tell how much the cause changes
        amplitudes : of the discrepancy over the stress; None for the floors and shares of a named cause
        """
        own, plain = self._projected(unit), self._projected(null)
        first = float(own[:, 0] @ self._stress / (own[:, 0] @ own[:, 0]))
        if not first > 0:
            return Fitted(-np.inf, np.nan, np.nan)
        if amplitudes is None:
            along = float(plain[:, 0] @ own[:, 0] / (plain[:, 0] @ plain[:, 0]))
            change = own[:, 0] - along * plain[:, 0]
            effect = float(np.linalg.norm(change) / np.linalg.norm(own[:, 0]))
            amplitudes = [float(np.hypot(floor, share * effect)) for floor in FLOORS for share in SHARES]
        return self._integrated(own, first, np.asarray(amplitudes))

    def _pairs(self) -> list[tuple[tuple[Rows, np.typing.NDArray[np.bool_]], FloatArray]]:
        return list(zip([pair for pair in self.tests if pair[1].any()], self._bases, strict=True))

    def _projected(self, unit: Sequence[FloatArray]) -> FloatArray:
        """Return the columns of stress per modulus, zeros, and scatter where there are several tests."""
        own = [values for values, (_, keep) in zip(unit, self.tests, strict=True) if keep.any()]
        count = len(own)
        columns = np.zeros((self.rows, 1 + count + (count if count > 1 else 0)))
        begin = 0
        for number, (values, ((rows, keep), base)) in enumerate(zip(own, self._pairs(), strict=True)):
            end = begin + int(keep.sum())
            columns[begin:end, 0] = base @ (values[keep] / rows.noise[keep])
            columns[begin:end, 1 + number] = base @ (_ZERO * rows.scale / rows.noise[keep])
            if count > 1:
                columns[begin:end, 1 + count + number] = columns[begin:end, 0]
            begin = end
        return columns

    def _integrated(self, columns: FloatArray, modulus: float, amplitudes: FloatArray) -> Fitted:
        """Return the fit, integrated over amplitudes (m,) of the discrepancy."""
        count = len(self._bases)
        variance = 1 + amplitudes[:, None] ** 2 * self._roughness
        design = columns.copy()
        design[:, 1 + count :] *= _SCATTER * modulus
        weighted = design.T / variance[:, None, :]
        precision = weighted @ design + np.diag([0.0, *[1.0] * (design.shape[1] - 1)])
        right = weighted @ self._stress
        values = np.linalg.solve(precision, right[..., None])[..., 0]
        misfit = np.maximum((1 / variance) @ self._stress**2 - np.sum(right * values, axis=1), 0.0)
        first = values[:, 0]
        if not np.any(first > 0):
            return Fitted(-np.inf, np.nan, np.nan)
        logs = (
            -0.5 * (_NOISE_ROWS + self.rows) * np.log1p(misfit / _NOISE_ROWS)
            - 0.5 * np.sum(np.log(variance), axis=1)
            - 0.5 * np.linalg.slogdet(precision)[1]
            - np.log(np.where(first > 0, first, 1.0))
        )
        logs = np.where(first > 0, logs, -np.inf)
        weights = np.exp(logs - logsumexp(logs))
        noisier = (_NOISE_ROWS + misfit) / (_NOISE_ROWS + self.rows)
        mean = float(weights @ first)
        spread = np.linalg.inv(precision)[:, 0, 0] * noisier + (first - mean) ** 2
        return Fitted(float(logsumexp(logs) - np.log(len(logs))), mean, float(np.sqrt(weights @ spread)))


def _kernel(rows: Rows, keep: np.typing.NDArray[np.bool_]) -> FloatArray:
    """Return the covariance (k, k) of a discrepancy of the size of the stress, over the noise."""
    steps = np.hypot(
        np.diff(rows.strain) / max(float(np.ptp(rows.strain)), 1e-300),
        np.diff(rows.stress) / np.ptp(rows.stress),
    )
    path = np.concatenate([[0.0], np.cumsum(steps)])[keep]
    smooth = np.exp(-0.5 * ((path[:, None] - path) / _LENGTH) ** 2)
    over = rows.scale / rows.noise[keep]
    return np.asarray(over[:, None] * smooth * over)


def _basis(rows: Rows, keep: np.typing.NDArray[np.bool_]) -> FloatArray:
    return np.asarray(np.linalg.eigh(_kernel(rows, keep))[1].T)


def _spectrum(rows: Rows, keep: np.typing.NDArray[np.bool_]) -> FloatArray:
    return np.maximum(np.linalg.eigh(_kernel(rows, keep))[0], 0.0)
