"""The experiment that a trajectory would make: every row that a synchronised recording would have, unmeasured."""

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from daq.frames import IDENTITY, rotation
from daq.rig import Specimen
from daq.trajectories.trajectory import Trajectory, experiment_kind
from estimator.experiment import Experiment, SensorNoise
from robot_drivers.protocols import FloatArray, Pose

# A way that takes less, s, is the rounding of a pose; a stay that is shorter has no row beside that of the arrival.
_SHORTEST_S = 1e-6


def planned_experiment(
    trajectory: Trajectory, specimen: Specimen, sensor: SensorNoise, order: int, rows_per_move: int = 2
) -> Experiment:
    """Lay out the rows of a trajectory: some on the way to each step, and one at the end of its standing there.

    A step that is only passed through has no row but those of its way.

    Parameters
    ----------
    trajectory, specimen : what is done, to what
    sensor : noise that the experiment will state
    order : 1 for the first experiment on the mounting
    rows_per_move : rows on the way to a step, the last of them on arrival

    Returns
    -------
    Experiment whose wrench and fiducials are NaN.
    """
    times, phases, numbers = [0.0], ["hold"], [0]
    positions, rotations = [np.zeros(3)], [Rotation.identity()]
    now, present = 0.0, IDENTITY
    for step in trajectory.steps[1:]:
        target = step.T_rest_gripper
        duration = move_duration_s(trajectory, present, target)
        if duration > _SHORTEST_S:
            for row in range(1, rows_per_move + 1):
                fraction = row / rows_per_move
                times.append(now + fraction * duration)
                phases.append("ramp" if step.phase == "hold" else "return")
                numbers.append(step.number)
                position, turned = _between(present, target, fraction)
                positions.append(position)
                rotations.append(turned)
        stood_s = step.settle_s + step.measure_s
        now, present = now + duration + stood_s, target
        if stood_s <= _SHORTEST_S:
            continue  # passed through: the row on arrival, if it went anywhere, is the only one
        times.append(now)
        phases.append(step.phase)
        numbers.append(step.number)
        positions.append(np.array(target.position))
        rotations.append(rotation(target.quaternion_wxyz))
    count, beads = len(times), len(specimen.fiducials_m)
    return Experiment(
        name=trajectory.kind,
        phantom_id=specimen.phantom_id,
        order=order,
        phantom=specimen.phantom,
        anchors=specimen.anchors,
        grasp=specimen.grasp,
        trajectory_kind=experiment_kind(trajectory.kind),
        environment=specimen.environment,
        sensor=sensor,
        fiducials_rest=np.array(specimen.fiducials_m),
        time=np.array(times),
        phase=tuple(phases),
        step=np.array(numbers, dtype=np.int64),
        position=np.array(specimen.grasp.centre) + np.array(positions),
        quaternion_wxyz=Rotation.concatenate(rotations).as_quat(canonical=True, scalar_first=True),
        wrench=np.full((count, 6), np.nan),
        fiducials=np.full((count, beads, 3), np.nan),
        rollers=specimen.rollers,
    )


def moves(experiment: Experiment) -> bool:
    """Tell whether the gripper is ever elsewhere than at rest."""
    poses = np.column_stack([experiment.position, experiment.quaternion_wxyz])
    return not np.allclose(poses, poses[0], rtol=0.0, atol=1e-9)


def move_duration_s(trajectory: Trajectory, start: Pose, stop: Pose) -> float:
    """Return how long the straight way between two steps takes at the trajectory's speed, s."""
    turn = rotation(stop.quaternion_wxyz) * rotation(start.quaternion_wxyz).inv()
    length = float(np.linalg.norm(np.subtract(stop.position, start.position)))
    return max(length / trajectory.speed.linear, float(turn.magnitude()) / trajectory.speed.angular)


def duration_s(trajectory: Trajectory) -> float:
    """Return how long a trajectory takes, its rest window included, s."""
    ways = zip(trajectory.steps, trajectory.steps[1:], strict=False)
    moving = sum(move_duration_s(trajectory, one.T_rest_gripper, other.T_rest_gripper) for one, other in ways)
    return moving + sum(step.settle_s + step.measure_s for step in trajectory.steps)


def _between(start: Pose, stop: Pose, fraction: float) -> tuple[FloatArray, Rotation]:
    ends = Rotation.concatenate([rotation(start.quaternion_wxyz), rotation(stop.quaternion_wxyz)])
    position = np.asarray(start.position) + fraction * np.subtract(stop.position, start.position)
    return position, Slerp([0.0, 1.0], ends)(fraction)
