"""How strong a cause noise alone would feign, given how many causes are looked for.

Of many tests the strongest is strong by chance. Noise is drawn many times, each draw is held against every signature
with the nuisances projected out, and the smallest of its tail probabilities is kept: their distribution tells how
small one must be to mean anything (a parametric bootstrap of the linearised fit; Westfall & Young, Resampling-Based
Multiple Testing, 1993). Signatures that resemble each other count as few, which Bonferroni's bound does not know.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from estimator.diagnosis.case import Linearisation
from estimator.diagnosis.contest import Trial
from estimator.diagnosis.discrepancy import ModelError, forgiven, moments_of

FloatArray = NDArray[np.float64]

_DRAWS = 400
_FALSE_ALARMS = 0.05
# A direction of whose squared length less than this share is left is none.
_UNSEEN = 1e-9


@dataclass(frozen=True)
class Multiplicity:
    """What is significant among so many tests.

    Attributes
    ----------
    level : a single effect's tail probability below which fewer than one in twenty noises has one
    chance : share of noises that feign a cause at least as strong as the strongest in the measurements
    """

    level: float
    chance: float

    def significant(self, chi2_drop: float, amplitudes: int) -> bool:
        """Tell whether a drop of the misfit by so many amplitudes is more than chance among all the tests."""
        return bool(chi2.sf(chi2_drop, amplitudes) < self.level)


def multiplicity_of(fit: Linearisation, trials: Sequence[Trial], error: ModelError) -> Multiplicity:
    """Hold noise against the signatures of effects beside a fit.

    Parameters
    ----------
    fit : whose free parameters are projected out
    trials : of the effects looked for
    error : whose floor, what even the right model misses, counts as noise
    """
    blocks = [
        np.column_stack([r, c, *(trial.signature.columns[number] for trial in trials)])
        for number, (r, c) in enumerate(zip(fit.residual, fit.by_coordinate, strict=True))
    ]
    gram, _ = forgiven(error, moments_of(error, blocks), error.floor)
    sizes = [len(trial.signature.coordinates) for trial in trials]
    return among_tests(gram, len(fit.coordinates), sizes)


def among_tests(gram: FloatArray, nuisances: int, sizes: Sequence[int], seed: int = 0) -> Multiplicity:
    """Hold noise against signatures.

    Parameters
    ----------
    gram : (1 + p + k)² inner products of the residual in units of white noise, of the derivatives by what is free
        without any effect, and of those by the amplitudes of all effects
    nuisances : p
    sizes : how many amplitudes each effect has
    """
    length = np.sqrt(np.maximum(np.diag(gram)[1:], np.finfo(float).tiny))
    cosine = gram[1:, 1:] / np.outer(length, length)
    # White noise meets the columns with inner products whose covariance is the columns' own.
    eigenvalues, eigenvectors = np.linalg.eigh(cosine)
    root = eigenvectors * np.sqrt(np.maximum(eigenvalues, 0.0))
    noise = root @ np.random.default_rng(seed).standard_normal((len(root), _DRAWS))
    seen = np.column_stack([gram[1:, 0] / length, noise])
    known = slice(0, nuisances)
    passed = np.linalg.pinv(cosine[known, known], hermitian=True) @ cosine[known]
    left, seen = cosine - cosine[:, known] @ passed, seen - passed.T @ seen[known]
    tails, at = np.ones(1 + _DRAWS), nuisances
    for size in sizes:
        own = slice(at, at + size)
        at += size
        values, directions = np.linalg.eigh(left[own, own])
        new = values > _UNSEEN
        if new.any():
            drops = np.sum((directions[:, new].T @ seen[own]) ** 2 / values[new, None], axis=0)
            tails = np.minimum(tails, chi2.sf(drops, int(new.sum())))
    return Multiplicity(float(np.quantile(tails[1:], _FALSE_ALARMS)), float(np.mean(tails[1:] <= tails[0])))
