"""What the model's own error could feign: how much an effect's direction explains of what meshes may have left.

No mesh errs in a way that is known beforehand. What a finer mesh changes tells how large the error is that is left in
each channel, not along which course, and it may well be that of an effect: a mesh is a little too stiff where strains
are singular, and so is tissue that stiffens. Along a change z of all channels what is left has, in units of the noise,
the variance

    d² = Σ_g s² ‖c_g‖² ‖z_g‖² / ‖z‖²

over force, torque and every bead g, whose errors have nothing to do with one another; c is what a finer mesh changes
and s the share of it that may be left. With Gaussian errors the log evidence of no cause rises by

    ½ x² d² / (1 + d²) − ½ ln (1 + d²)

where the misfit along z is x. However quiet the sensors, a cause is believed only as far as it stands out from what
meshes may have left. With usual sensors that is next to nothing: d² falls with the square of the noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import ModelError, forgiven, moments_of
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.effects.effect import Effect
from estimator.inference.free_parameter import prior_information

FloatArray = NDArray[np.float64]

_FORCES, _WRENCH, _AXES = 3, 6, 3


def may_be_feigned(effect: Effect) -> bool:
    """Tell whether a mesh could do what an effect does: what acts on the mechanics, not what a sensor makes of them."""
    return effect.acts_on_tissue and not effect.misreads_rest


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
    if not case.corrections:
        return 0.0
    change = [
        whitening.apply((after - before)[:, :, None])
        for whitening, before, after in zip(case.whitenings, base.predicted, predicted, strict=True)
    ]
    if not any(np.any(columns) for columns in change):
        return 0.0
    variance = _variance_along(case, change)
    blocks = zip(base.residual, base.jacobian, change, strict=True)
    moments = moments_of(error, [np.column_stack(block) for block in blocks])
    gram, _ = forgiven(error, moments, error.floor)
    # What E and ν, and causes that are in already, take of the change is none of the effect's.
    free = slice(1, 1 + base.jacobian[0].shape[1])
    known = gram[free, free] + prior_information(base.free_parameters)
    taken = np.linalg.solve(known, gram[free, -1])
    length = gram[-1, -1] - gram[-1, free] @ taken
    along = gram[0, -1] - gram[0, free] @ taken
    if length <= 0.0:
        return 0.0
    found = 0.5 * along**2 / length * variance / (1.0 + variance) - 0.5 * np.log1p(variance)
    return max(float(found), 0.0)


def _variance_along(case: Case, change: Sequence[FloatArray]) -> float:
    """Return the variance of what meshes may have left along a whitened change (r, 1) of each experiment."""
    share = case.settings.noise.mesh_share_apart * case.errors_left.elsewhere
    sources = _sources(case.corrections[0].shape[1])
    left, seen = np.zeros((2, sources.max() + 1))
    for whitening, correction, columns in zip(case.whitenings, case.corrections, change, strict=True):
        size = (share * correction / whitening.deviation) ** 2
        left += np.bincount(sources, np.where(whitening.seen, size, 0.0).sum(axis=0))
        source = sources[np.nonzero(whitening.seen)[1]]
        seen += np.bincount(source, columns[:, 0] ** 2, len(seen))
    return float(left @ seen / seen.sum())


def _sources(channels: int) -> NDArray[np.int64]:
    """Return for each channel (c,) the number of its source: force, torque, then each bead."""
    channel = np.arange(channels)
    return np.where(channel < _WRENCH, channel // _FORCES, _WRENCH // _FORCES + (channel - _WRENCH) // _AXES)
