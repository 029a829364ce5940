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
from estimator.diagnosis.discrepancy import ModelError, forgiven

FloatArray = NDArray[np.float64]

_DRAWS = 400
_FALSE_ALARMS = 0.05
# A direction of which less than this share is left is none.
_UNSEEN = 1e-6


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
    signatures = [_floored(trial.signature.columns, error) for trial in trials]
    return among_tests(_floored(fit.residual, error)[:, 0], _floored(fit.by_coordinate, error), signatures)


def among_tests(
    residual: FloatArray, nuisances: FloatArray, signatures: Sequence[FloatArray], seed: int = 0
) -> Multiplicity:
    """Hold noise against signatures.

    Parameters
    ----------
    residual : (r,) in units of white noise
    nuisances : (r, p) derivatives by what is free without any effect
    signatures : of each effect (r, k), derivatives by its amplitudes
    """
    noise = np.random.default_rng(seed).standard_normal((len(residual), _DRAWS))
    seen = np.column_stack([residual, noise])
    nuisance = _orthonormal(nuisances)
    tails = np.ones(1 + _DRAWS)
    for signature in signatures:
        directions = _new_directions(signature, nuisance)
        if directions.shape[1]:
            drops = np.sum((directions.T @ seen) ** 2, axis=0)
            tails = np.minimum(tails, chi2.sf(drops, directions.shape[1]))
    return Multiplicity(float(np.quantile(tails[1:], _FALSE_ALARMS)), float(np.mean(tails[1:] <= tails[0])))


def _floored(blocks: Sequence[FloatArray], error: ModelError) -> FloatArray:
    whitened, _ = forgiven(error, [block.reshape(len(block), -1) for block in blocks], error.floor)
    return np.concatenate(whitened)


def _new_directions(signature: FloatArray, nuisance: FloatArray) -> FloatArray:
    """Return an orthonormal basis of what columns of a signature show besides the nuisances."""
    length = np.linalg.norm(signature, axis=0)
    left = signature - nuisance @ (nuisance.T @ signature)
    return _orthonormal(left[:, np.linalg.norm(left, axis=0) > _UNSEEN * length])


def _orthonormal(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis (r, k) of what columns span."""
    vectors, values, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.asarray(vectors[:, values > _UNSEEN])
