"""What the sensors read of a solved case, row by row, and its derivative by any perturbation of the hypothesis."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import Mechanics
from estimator.diagnosis.sensitivity.mechanical_changes import all_mechanical_changes
from estimator.diagnosis.sensitivity.perturbation import MechanicalChange, Perturbation
from estimator.effects.effect import Readings
from estimator.effects.shared.zeroing import with_wrench_zeroed
from estimator.inference.channels import channels_by_pose, side_by_side

FloatArray = NDArray[np.float64]


def predicted_readings(
    mechanics: Mechanics,
    hypothesis: Hypothesis,
    correction: FloatArray,
    change: MechanicalChange | None = None,
) -> Readings:
    """Return what the sensors of an experiment read in every row.

    Parameters
    ----------
    mechanics : of the experiment
    hypothesis : whose sensors read it
    correction : (n, 6 + 3m) of the discretisation, added to the mechanics
    change : of the mechanics, added as well
    """
    solution = mechanics.solution
    rows = solution.load_steps.of_row
    wrench = mechanics.wrench[rows] + correction[:, :6]
    fiducials = mechanics.fiducials[rows]
    fiducials = fiducials + correction[:, 6:].reshape(fiducials.shape)
    position, rotation = solution.motion.position[rows], solution.motion.rotation[rows]
    if change is not None:
        wrench, fiducials = wrench + change.wrench, fiducials + change.fiducials
        position = position + change.motion[:, :3]
        rotation = Rotation.from_rotvec(change.motion[:, 3:]) * rotation
    rest_wrench, rest_fiducials = _at_rest(mechanics, correction[0])
    if change is not None:
        rest_wrench, rest_fiducials = rest_wrench + change.wrench[0], rest_fiducials + change.fiducials[0]
    readings = Readings(
        solution.load_steps.experiment,
        position,
        rotation,
        solution.load_steps.position[rows],
        wrench,
        fiducials,
        rest_wrench,
        rest_fiducials,
    )
    if readings.experiment.zeroed_under_load:
        readings = with_wrench_zeroed(readings)
    return hypothesis.readings(readings)


def _at_rest(mechanics: Mechanics, correction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return wrench (6,) and fiducials (m, 3) with the gripper exactly at its stated rest pose.

    ``correction`` (6 + 3m,) is that of the first row.
    """
    first, off = mechanics.observations[0], mechanics.solution.load_steps.off_rest
    wrench = first.wrench - first.wrench_by_pose @ off + correction[:6]
    fiducials = first.fiducials - first.fiducials_by_pose @ off
    return wrench, fiducials + correction[6:].reshape(fiducials.shape)


def channels(readings: Readings) -> FloatArray:
    """Return wrench and fiducials side by side, (n, 6 + 3m)."""
    return side_by_side(readings.wrench, readings.fiducials)


def derivatives(
    mechanics: Sequence[Mechanics],
    hypothesis: Hypothesis,
    perturbations: Sequence[Perturbation],
    corrections: Sequence[FloatArray],
) -> list[FloatArray]:
    """Return for each experiment the derivative (n, 6 + 3m, k) of all channels by each perturbation."""
    base = [
        channels(predicted_readings(one, hypothesis, correction))
        for one, correction in zip(mechanics, corrections, strict=True)
    ]
    found = [np.empty((*b.shape, len(perturbations))) for b in base]
    all_changes = all_mechanical_changes(mechanics, hypothesis, perturbations)
    for k, (perturbation, changes) in enumerate(zip(perturbations, all_changes, strict=True)):
        for number, (one, correction) in enumerate(zip(mechanics, corrections, strict=True)):
            change = changes[number] if changes is not None else None
            moved = predicted_readings(one, perturbation.to, correction, change)
            found[number][:, :, k] = (channels(moved) - base[number]) / perturbation.step
    return found


def derivatives_by_pose(mechanics: Mechanics) -> FloatArray:
    """Return the derivative (v, 6 + 3m, 6) of the mechanics by the gripper's pose at each load step."""
    return np.array([channels_by_pose(observation) for observation in mechanics.observations])
