"""What the model's own error could feign: how much an effect's direction explains of what meshes may have left.

No mesh errs in a way that is known beforehand. What a finer mesh changes tells how large the error is that is left in
each channel, not along which course, and it may well be that of an effect: a mesh is a little too stiff where strains
are singular, and so is tissue that stiffens. Along a change z of all channels what is left has, in units of the noise,
the variance

    d² = Σ_g s² ‖c_g‖² ‖z_g‖² / (w ‖z‖²)

over force, torque and every bead g, whose errors have nothing to do with one another; c is what a finer mesh changes,
s the share of it that may be left, and w the number of shapes that it may have along the gripper's way. With Gaussian
errors the log evidence of no cause rises by

    ½ x² d² / (1 + d² l²) − ½ ln (1 + d² l²)

where the misfit along z is x, and l is what is left of z's unit length once what is free in the fit has taken its part;
integrated over the floors of what any model misses, as every evidence is. However quiet the sensors, a cause is
believed only as far as it stands out from what meshes may have left. With usual sensors that is next to nothing: d²
falls with the square of the noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import ModelError, forgiven, moments_of
from estimator.diagnosis.evidence.floors import log_evidence
from estimator.diagnosis.evidence.marginal_likelihood import priors_within_a_step
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.noise.refinement import refinement_of
from estimator.effects.effect import Effect
from estimator.inference.free_parameter import prior_information
from estimator.inference.laplace import log_mean

FloatArray = NDArray[np.float64]

_FORCES, _WRENCH, _AXES = 3, 6, 3


def may_be_feigned(effect: Effect) -> bool:
    """Tell whether a mesh could do what an effect does: what moves tissue, or where cameras see it.

    Beads that a mesh has a few micrometres aside look like cameras whose scale is off. No mesh makes a sensor's axes
    leak, or its clock late.
    """
    return effect.acts_on_tissue or "seen" in effect.acts_on


def feigned_evidence(
    case: Case, base: Linearisation, error: ModelError, predicted: Sequence[FloatArray]
) -> float:
    """Return by how much the log evidence of a fit rises for what meshes may have left along a change, 0 or more.

    It is 0 where nobody has looked at what a finer mesh changes.

    Parameters
    ----------
    base : the fit without the effect
    error : what any model misses
    predicted : for each experiment (n, 6 + 3m), channels with the effect
    """
    found = 0.0
    if case.corrections:
        change = [
            whitening.apply((after - before)[:, :, None])
            for whitening, before, after in zip(case.whitenings, base.predicted, predicted, strict=True)
        ]
        blocks = zip(base.residual, base.jacobian, change, strict=True)
        moments = moments_of(error, [np.column_stack(block) for block in blocks])
        number = moments.gram.shape[0] - 1
        # Of the amplitude of the change as it is.
        variance = _variance_along(case, change) / max(moments.gram[number, number], np.finfo(float).tiny)
        without = moments.among(range(number))
        priors = priors_within_a_step(base.free_parameters, case.settings.evidence)
        plain = np.array([log_evidence(without, priors, error, floor) for floor in error.floors])
        raised = [_raised(base, forgiven(error, moments, floor)[0], variance) for floor in error.floors]
        found = log_mean(plain + np.array(raised)) - log_mean(plain)
    return max(found, 0.0)


def _raised(base: Linearisation, gram: FloatArray, variance: float) -> float:
    """Return by how much the log evidence rises for an error along a change, whose amplitude has a variance.

    ``gram`` are the inner products of the residual, the derivatives by what is free in the fit, and the change: what
    these take of it is none of the effect's.
    """
    free = slice(1, gram.shape[0] - 1)
    known = gram[free, free] + prior_information(base.free_parameters)
    taken = np.linalg.solve(known, gram[free, -1])
    grown = variance * max(float(gram[-1, -1] - gram[-1, free] @ taken), 0.0)
    along = float(gram[0, -1] - gram[0, free] @ taken)
    return 0.5 * variance * along**2 / (1.0 + grown) - 0.5 * float(np.log1p(grown))


def _variance_along(case: Case, change: Sequence[FloatArray]) -> float:
    """Return the variance of what meshes may have left along a whitened change (r, 1) of each experiment."""
    settings = case.settings.noise
    apart = refinement_of(case.experiments[0]).share_left(settings.mesh_share_apart)
    share = apart * case.errors_left.elsewhere / np.sqrt(settings.waves_beside_rim)
    sources = _sources(case.corrections[0].shape[1])
    left, seen = np.zeros((2, sources.max() + 1))
    for whitening, correction, columns in zip(case.whitenings, case.corrections, change, strict=True):
        size = (share * correction / whitening.deviation) ** 2
        left += np.bincount(sources, np.where(whitening.seen, size, 0.0).sum(axis=0))
        source = sources[np.nonzero(whitening.seen)[1]]
        seen += np.bincount(source, columns[:, 0] ** 2, len(seen))
    return float(left @ seen / max(seen.sum(), np.finfo(float).tiny))


def _sources(channels: int) -> NDArray[np.int64]:
    """Return for each channel (c,) the number of its source: force, torque, then each bead."""
    channel = np.arange(channels)
    return np.where(channel < _WRENCH, channel // _FORCES, _WRENCH // _FORCES + (channel - _WRENCH) // _AXES)
