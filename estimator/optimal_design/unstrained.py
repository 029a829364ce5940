"""What the sensors read while no tissue is strained: a still minute, or an empty gripper in the air.

Nothing pulls at the gripper, and what the cameras look at goes with it (a marker on the jaws) or stands still (a board,
beads at rest). So the motion and the sensors alone decide, and no equilibrium is solved.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.effects.blocks import Group
from estimator.effects.effect import Effect, Motion, Readings
from estimator.experiment import Experiment
from estimator.inference.channels import channel_variance, measured_rows, side_by_side
from estimator.inference.whitening import Whitening, inverse_root

FloatArray = NDArray[np.float64]

# Only these groups act where there is no tissue: how it is held, and where it lies, is of no account then.
_DEVICES: tuple[Group, ...] = ("force", "timing", "vision", "robot")


def unstrained_channels(experiment: Experiment, hypothesis: Hypothesis) -> FloatArray:
    """Return wrench and fiducials side by side, (n, 6 + 3m), N, N·m and m, as a hypothesis has them."""
    rows = len(experiment.time)
    turned = Rotation.from_quat(experiment.quaternion_wxyz, scalar_first=True)
    nothing = np.zeros((rows, 6))
    reported = Motion(experiment, experiment.position, turned, nothing, nothing, experiment.time)
    motion = hypothesis.motion(reported)
    rest = experiment.fiducials_rest
    places = np.zeros((rows, len(rest), 3))
    # What is carried goes with the gripper's own frame; what is not stands still, and so does the gripper then.
    for number, arm in enumerate(rest - np.asarray(experiment.grasp.centre)):
        places[:, number] = motion.position + motion.rotation.apply(arm)
    readings = Readings(
        experiment,
        motion.position,
        motion.rotation,
        experiment.position,
        nothing,
        places,
        np.zeros(6),
        rest,
    )
    found = hypothesis.readings(readings)
    return side_by_side(found.wrench, found.fiducials)


def unstrained_whitening(experiment: Experiment) -> Whitening:
    """Return the whitening of white noise, and of a zero and rest places that are off by as much as one reading is."""
    seen = np.isfinite(measured_rows(experiment))
    rows, count = seen.shape
    offsets = np.broadcast_to(np.eye(count), (rows, count, count))[seen]
    deviation = np.sqrt(channel_variance(experiment))
    return Whitening(seen, deviation, np.zeros(count), *inverse_root(offsets[:, seen.any(axis=0)]))


def unstrained_signature(
    experiment: Experiment, baseline: Hypothesis, effect: Effect, constants: Mapping[str, float]
) -> FloatArray:
    """Return the whitened derivative (r, k) by an effect's amplitudes at their null."""
    whitening = unstrained_whitening(experiment)
    absent = {amplitude.name: 0.0 for amplitude in effect.amplitudes}
    null = baseline.with_effect(effect, {**constants, **absent})
    number = len(null.effects) - 1
    free = [one for one in free_parameters(null) if one.effect == number and one.key in absent]
    before = unstrained_channels(experiment, null)
    shows = effect.group in _DEVICES and not effect.of_single_beads
    moved = [one.put(null, one.step) if shows else null for one in free]
    columns = [
        (unstrained_channels(experiment, to) - before) / one.step for one, to in zip(free, moved, strict=True)
    ]
    return whitening.apply(np.stack(columns, axis=-1))
