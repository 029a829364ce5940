r"""How probable the rows of tests are under a specimen: E, zeros of the load cell and scatter of specimens integrated.

With A the stress per modulus and a constant for each test, T the prior deviations, and the covariance of the errors
C = N + s² K (N the noise, K a squared exponential along the path with a length of a third of a stroke),

    χ² = yᵀ C⁻¹ y - bᵀ M⁻¹ b,  M = Aᵀ C⁻¹ A + T⁻²,  b = Aᵀ C⁻¹ y
    ln p = -(ν + n)/2 ln(1 + χ²/ν) - ½ ln det C - ½ ln det M - ½ ln det T² - ln E

C. E. Rasmussen & C. K. I. Williams, Gaussian Processes for Machine Learning (2006), section 2.7; the noise is known
to ν rows only, which makes a Student t of it. s is integrated over a grid: what even the right model misses, and a
share of what the cause explains (M. C. Kennedy & A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425).

All is computed along the eigenvectors of N^-½ K N^-½, where every C is diagonal.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.inference.laplace import log_mean
from estimator.uniaxial.diagnosis.rows import Rows
from estimator.uniaxial.records import FloatArray

FLOORS = (0.0005, 0.002, 0.005)
SHARES = (0.0, 0.03, 0.08, 0.2)
UNKNOWN_AMPLITUDES = tuple(float(one) for one in np.geomspace(0.01, 0.4, 8))
_LENGTH = 0.35
_NOISE_ROWS = 20.0
_ZERO = 0.01  # of the root mean square stress
_SCATTER = 0.03  # between specimens, of the stress

Kept = Sequence[NDArray[np.bool_]]


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """What is left once the linear parameters are found.

    Attributes
    ----------
    log_density : of the rows
    modulus, modulus_std : E and its deviation at these stresses, Pa
    design : (r, c) what the linear parameters do, E first, along the eigenvectors
    precision : (c, c) of the linear parameters
    weight : (r,) inverse variances, averaged over the amplitudes
    """

    log_density: float
    modulus: float
    modulus_std: float
    design: FloatArray
    precision: FloatArray
    weight: FloatArray

    def about(self, changes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what rows tell of parameters by which stress per modulus changes by so much (r, k).

        The information (k, k), the linear parameters being free, and by how much E goes along with each (k,).
        """
        along = self.modulus * changes
        weighted = self.weight[:, None] * along
        cross = self.design.T @ weighted
        taken = np.linalg.solve(self.precision, cross)
        return along.T @ weighted - cross.T @ taken, -taken[0]


class Likelihood:
    """Of tests whose rows may be taken in part.

    Parameters
    ----------
    tests : all of them
    kept : for each test which rows count, (n,) of bool; all where it is None
    """

    def __init__(self, tests: Sequence[Rows], kept: Kept | None = None) -> None:
        self.tests = tuple(tests)
        every = [np.ones(len(rows.strain), dtype=bool) for rows in tests] if kept is None else kept
        self._seen = [
            (number, keep, *_eigen(rows, keep))
            for number, (rows, keep) in enumerate(zip(tests, every, strict=True))
            if keep.any()
        ]
        self._stress = self.along([rows.stress for rows in tests])
        self._roughness = np.concatenate([roughness for _, _, roughness, _ in self._seen])
        scales = [np.full(len(rows.strain), _ZERO * rows.scale) for rows in tests]
        constant = self.along(scales)
        self._test_of_row = np.repeat(
            np.arange(len(self._seen)), [len(roughness) for _, _, roughness, _ in self._seen]
        )
        own = self._test_of_row[:, None] == np.arange(len(self._seen))
        self._zeros, self._own = np.where(own, constant[:, None], 0.0), own

    def along(self, values: Sequence[FloatArray]) -> FloatArray:
        """Return the rows that count of one array a test, over their noise, along the eigenvectors (r,)."""
        return np.concatenate(
            [
                vectors.T @ (values[number][keep] / self.tests[number].noise[keep])
                for number, keep, _, vectors in self._seen
            ]
        )

    def of(
        self, unit: FloatArray, null: FloatArray, amplitudes: Sequence[float] | None = None
    ) -> Fitted | None:
        """Return the fit of stresses per modulus (r,) along the eigenvectors; None where E would not be above zero.

        Parameters
        ----------
        null : the Neo-Hookean ones, to tell how much the cause changes
        amplitudes : of the discrepancy over the stress; None for the floors and shares of a named cause
        """
        square = float(unit @ unit)
        first = float(unit @ self._stress) / square if square > 0 else 0.0
        if not first > 0:
            return None
        if amplitudes is None:
            change = unit - float(null @ unit) / float(null @ null) * null
            effect = float(np.linalg.norm(change)) / np.sqrt(square)
            amplitudes = [float(np.hypot(floor, share * effect)) for floor in FLOORS for share in SHARES]
        columns = [unit[:, None], self._zeros]
        if len(self._seen) > 1:
            columns.append(np.where(self._own, _SCATTER * first * unit[:, None], 0.0))
        return self._integrated(np.hstack(columns), np.asarray(amplitudes))

    def _integrated(self, design: FloatArray, amplitudes: FloatArray) -> Fitted | None:
        """Return the fit, integrated over amplitudes (m,) of the discrepancy."""
        rows, linear = design.shape
        variance = 1 + amplitudes[:, None] ** 2 * self._roughness
        weighted = design.T / variance[:, None, :]
        prior = np.diag([0.0, *[1.0] * (linear - 1)])
        precision = weighted @ design + prior
        right = weighted @ self._stress
        inverse = np.linalg.inv(precision)
        values = np.einsum("mij,mj->mi", inverse, right)
        misfit = np.maximum((1 / variance) @ self._stress**2 - np.sum(right * values, axis=1), 0.0)
        positive = values[:, 0] > 0
        if not positive.any():
            return None
        first = np.where(positive, values[:, 0], 1.0)
        logs = (
            -0.5 * (_NOISE_ROWS + rows) * np.log1p(misfit / _NOISE_ROWS)
            - 0.5 * np.sum(np.log(variance), axis=1)
            - 0.5 * np.linalg.slogdet(precision)[1]
            - np.log(first)
        )
        logs = np.where(positive, logs, -np.inf)
        log_density = log_mean(logs)
        shares = np.exp(logs - log_density) / len(logs)
        quieter = (_NOISE_ROWS + rows) / (_NOISE_ROWS + misfit)
        mean = float(shares @ first)
        spread = inverse[:, 0, 0] / quieter + (first - mean) ** 2
        weight = (shares * quieter) @ (1 / variance)
        return Fitted(
            log_density,
            mean,
            float(np.sqrt(shares @ spread)),
            design,
            (design.T * weight) @ design + prior,
            weight,
        )


def _eigen(rows: Rows, keep: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """Return variances (k,) and directions (k, k) of a discrepancy of the size of the stress, over the noise."""
    steps = np.hypot(
        np.diff(rows.strain) / max(float(np.ptp(rows.strain)), 1e-300),
        np.diff(rows.stress) / np.ptp(rows.stress),
    )
    path = np.concatenate([[0.0], np.cumsum(steps)])[keep]
    apart = np.sqrt(3) * np.abs(path[:, None] - path) / _LENGTH
    smooth = (1 + apart) * np.exp(-apart)
    over = rows.scale / rows.noise[keep]
    values, vectors = np.linalg.eigh(over[:, None] * smooth * over)
    return np.maximum(values, 0.0), vectors
