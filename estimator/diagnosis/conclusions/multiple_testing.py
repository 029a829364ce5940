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
from scipy.special import chdtrc

from estimator.diagnosis.evidence.discrepancy import forgiven
from estimator.diagnosis.evidence.rivals import Rivals, projected
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.screening import Trial, moments_beside
from estimator.diagnosis.settings import ConclusionSettings

FloatArray = NDArray[np.float64]


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
        return bool(chdtrc(amplitudes, max(chi2_drop, 0.0)) < self.level)


def rivals_of(context: Context, trials: Sequence[Trial]) -> tuple[Rivals, FloatArray]:
    """Return the effects of trials as rivals, and the inner products (k,) of a fit's misfit with them.

    Parameters
    ----------
    context : the free parameters of its solved hypothesis are projected out, and the floor of its error, what even the
        right model misses, counts as noise
    trials : of the effects looked for
    """
    moments = moments_beside(context, [trial.signature for trial in trials])
    gram, _ = forgiven(context.error, moments, context.error.floor)
    labels = [trial.signature.effect.label for trial in trials]
    sizes = [len(trial.signature.free_parameters) for trial in trials]
    return projected(gram, len(context.baseline.free_parameters), labels, sizes)


def multiplicity_of(
    rivals: Rivals, seen: FloatArray, settings: ConclusionSettings, seed: int = 0
) -> Multiplicity:
    """Hold noise against signatures.

    Parameters
    ----------
    rivals : the effects looked for
    seen : (k,) inner products of the misfit with their signatures
    settings : how many noises are drawn, and how many of them may feign a cause
    """
    inner = np.column_stack([seen, rivals.noise(settings.draws, seed)])
    tails = np.ones(1 + settings.draws)
    for own in rivals.slices():
        directions = rivals.directions(own)
        if directions.size:
            drops = np.sum((directions.T @ inner[own]) ** 2, axis=0)
            tails = np.minimum(tails, chdtrc(directions.shape[1], drops))
    return Multiplicity(
        float(np.quantile(tails[1:], settings.false_alarms)), float(np.mean(tails[1:] <= tails[0]))
    )
