"""Expected information: by how much data that are foreseen would reduce the entropy over answers.

Under each answer k, of probability p_k, the whitened data of an experiment are foreseen as y ~ N(m_k, I + S_k S_kᵀ).
What the experiment is expected to tell of which answer is right is the mutual information (Lindley, Ann. Math. Statist.
27 (1956) 986)

    I = Σ_k p_k E_{y|k} [ln p(y | k) − ln Σ_j p_j p(y | j)],

from 0 to the entropy of the p_k. It is a mean over draws. All answers, and all experiments that are compared, have
the same standard normals in their draws (common random numbers), so that differences between experiments are less
noisy than the values. What no answer's mean or spread has a part in is the same noise under all, and left out.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

FloatArray = NDArray[np.float64]

DRAWS = 200
# Directions in which the answers differ by less than this share of a reading's noise tell nothing.
_NOTHING = 1e-3


@dataclass(frozen=True, eq=False)
class Predictive:
    """What one answer foresees: whitened data y ~ N(mean, I + spread spreadᵀ).

    Attributes
    ----------
    mean : (r,)
    spread : (r, q) of parameters that are not known, and of what the model misses
    """

    mean: FloatArray
    spread: FloatArray


@dataclass(frozen=True, slots=True)
class Expected:
    """Expected information in nats, with the standard error of its mean over draws."""

    nats: float
    std: float


def entropy(probability: Sequence[float] | FloatArray) -> float:
    """Return the entropy of probabilities that sum up to one, nats."""
    p = np.asarray(probability, dtype=np.float64)
    return float(-np.sum(p[p > 0] * np.log(p[p > 0])))


def expected_information(
    probability: Sequence[float], foreseen: Sequence[Predictive], draws: int = DRAWS, seed: int = 0
) -> Expected:
    """Return by how much an experiment is expected to reduce the entropy over answers.

    Parameters
    ----------
    probability : of each answer; they are taken to sum up to one
    foreseen : what each answer foresees of the experiment, in one whitening
    draws : of data under each answer
    seed : of the standard normals, common to all that are compared
    """
    p = np.asarray(probability, dtype=np.float64)
    p = p / p.sum()
    reduced = _reduced(foreseen)
    dimensions = len(reduced[0].mean)
    if dimensions == 0:
        return Expected(0.0, 0.0)
    factors = [_root(_covariance(one)) for one in reduced]
    random = np.random.default_rng(seed)
    # Row by row, so that more dimensions draw the same numbers in those that there were.
    normals = np.array([random.standard_normal(draws) for _ in range(dimensions)])
    means, variances = np.zeros(len(p)), np.zeros(len(p))
    for k, (one, factor) in enumerate(zip(reduced, factors, strict=True)):
        data = one.mean[:, None] + factor @ normals
        logs = np.array(
            [_log_density(data, each.mean, root) for each, root in zip(reduced, factors, strict=True)]
        )
        gained = logs[k] - logsumexp(logs, axis=0, b=p[:, None])
        means[k], variances[k] = gained.mean(), gained.var() / draws
    return Expected(float(p @ means), float(np.sqrt(p**2 @ variances)))


def log_evidence(foreseen: Sequence[Predictive], data: FloatArray) -> FloatArray:
    """Return ln p(data | answer) of each answer but for a constant common to all; ``data`` is whitened (r,)."""
    reduced = _reduced([*foreseen, Predictive(data, np.zeros((len(data), 0)))])
    *answers, measured = reduced
    return np.array(
        [float(_log_density(measured.mean[:, None], one.mean, _root(_covariance(one)))[0]) for one in answers]
    )


def updated(probability: Sequence[float], log_evidences: FloatArray) -> FloatArray:
    """Return probabilities after data of which the log evidence under each answer is given."""
    with np.errstate(divide="ignore"):
        score = np.log(np.asarray(probability, dtype=np.float64)) + log_evidences
    return np.asarray(np.exp(score - logsumexp(score)))


def _reduced(foreseen: Sequence[Predictive]) -> list[Predictive]:
    """Return the same in the directions in which the answers differ at all."""
    centre = foreseen[0].mean
    columns = np.column_stack(
        [block for one in foreseen for block in ((one.mean - centre)[:, None], one.spread)]
    )
    vectors, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    basis = vectors[:, sizes > _NOTHING]
    return [Predictive(basis.T @ (one.mean - centre), basis.T @ one.spread) for one in foreseen]


def _covariance(one: Predictive) -> FloatArray:
    return np.asarray(np.eye(len(one.mean)) + one.spread @ one.spread.T)


def _root(covariance: FloatArray) -> FloatArray:
    """Return the lower triangular root."""
    return np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)


def _log_density(data: FloatArray, mean: FloatArray, root: FloatArray) -> FloatArray:
    """Return the log density (n,) of data (d, n), but for the constant that all answers share."""
    whitened = solve_triangular(root, data - mean[:, None], lower=True)
    return np.asarray(-0.5 * np.sum(whitened**2, axis=0) - np.sum(np.log(np.diag(root))))


def best_parted(probability: Sequence[float], foreseen: Sequence[Predictive]) -> tuple[int, int]:
    """Return the two answers that an experiment parts best, by the probability that they are confused without it.

    Two answers are confused by √(p_i p_j) times the overlap of what they foresee (A. Bhattacharyya, Bull. Calcutta
    Math. Soc. 35 (1943) 99); what the experiment takes of that is what counts.
    """
    reduced = _reduced(foreseen)
    covariances = [_covariance(one) for one in reduced]
    best, pair = -1.0, (0, 0)
    for one, other in itertools.combinations(range(len(reduced)), 2):
        both = 0.5 * (covariances[one] + covariances[other])
        apart = reduced[one].mean - reduced[other].mean
        distance = apart @ np.linalg.solve(both, apart) / 8.0
        logs = [np.linalg.slogdet(each)[1] for each in (both, covariances[one], covariances[other])]
        overlap = float(np.exp(-distance - 0.5 * (logs[0] - 0.5 * (logs[1] + logs[2]))))
        taken = float(np.sqrt(probability[one] * probability[other])) * (1.0 - overlap)
        if taken > best:
            best, pair = taken, (one, other)
    return pair
