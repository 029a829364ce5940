"""Single readings of a bead that are wild: a reflection taken for it, for one image.

The misfit of a bead is smooth along the rows but for noise, whatever the model leaves out, and where the motion turns
that of all beads turns with it. A reading far from the mean of those before and after it, which agree with each other,
and not like those of the other beads, is left out. A bead that is read falsely from some row on is no glitch.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]

# In standard deviations: of 10 000 readings of mere noise, of three coordinates each, 0.2 are lost.
_WILD = 4.5
_AGREE = 4.0
# Of x_t − ½ (x_s + x_u) for unit white noise.
_SPREAD = np.sqrt(1.5)
_TO_DEVIATION = 1.4826


def without_glitches(
    experiments: Sequence[Experiment], misfits: Sequence[FloatArray]
) -> tuple[Experiment, ...]:
    """Return the experiments with NaN for the readings of beads that are wild.

    Parameters
    ----------
    misfits : for each experiment (n, 6 + 3m), measured less predicted in units of the noise, NaN where not measured
    """
    return tuple(
        replace(e, fiducials=np.where(_glitches(misfit[:, 6:])[:, :, None], np.nan, e.fiducials))
        for e, misfit in zip(experiments, misfits, strict=True)
    )


def number_left_out(given: Sequence[Experiment], kept: Sequence[Experiment]) -> int:
    """Return how many readings of a bead the kept experiments lack; both in any order."""
    return _readings(given) - _readings(kept)


def _readings(experiments: Sequence[Experiment]) -> int:
    return sum(int(np.isfinite(each.fiducials).all(axis=2).sum()) for each in experiments)


def _glitches(misfit: FloatArray) -> NDArray[np.bool_]:
    """Tell which bead is wild in which row (n, m), of a misfit (n, 3m)."""
    beads = misfit.reshape(len(misfit), -1, 3)
    wild = np.zeros(beads.shape[:2], dtype=bool)
    if len(beads) < 3:
        return wild
    before, here, after = beads[:-2], beads[1:-1], beads[2:]
    off = here - 0.5 * (before + after)
    middle = np.nanmedian(np.where(np.isfinite(off).any(axis=1, keepdims=True), off, 0.0), axis=1)[:, None]
    spread = _TO_DEVIATION * np.nanmedian(
        np.abs(np.where(np.isfinite(off).any(axis=1, keepdims=True), off - middle, 0.0)), axis=1
    )
    far = np.abs(off - middle) > _WILD * np.maximum(spread, _SPREAD)[:, None]
    agree = np.abs(after - before) < _AGREE * np.sqrt(2.0)
    wild[1:-1] = (far & agree).any(axis=2)
    return wild
