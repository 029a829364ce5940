"""What each cause would add to the observations, to first order: columns that a least-squares fit may use."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from challenge_baselines.case_folder import Experiment, FloatArray

# Wrench (n, 6) and ways of beads (n, m, 3) that one column adds.
Column = tuple[FloatArray, FloatArray]

_FAST_S, _SLOW_S = 2.0, 10.0


@dataclass(frozen=True)
class Fitted:
    """An experiment beside what the fitted elastic block says of it.

    Attributes
    ----------
    wrench, beads : (n, 6), (n, m, 3) as fitted
    stiffness : (6, 6) of the fitted block, wrench by motion
    shape : (m, 3, 6) ways of its beads by motion
    share : (n,) of the largest way of the gripper in this case
    """

    experiment: Experiment
    wrench: FloatArray
    beads: FloatArray
    stiffness: FloatArray
    shape: FloatArray
    share: FloatArray

    @property
    def is_return(self) -> FloatArray:
        """1 on the way back, else 0."""
        return np.char.startswith(self.experiment.phase, "return").astype(np.float64)

    def both(self, factor: FloatArray) -> Column:
        """Return the fitted observations times a factor (n,)."""
        return self.wrench * factor[:, None], self.beads * factor[:, None, None]

    def forces(self, wrench: FloatArray) -> Column:
        """Return a column of the wrench alone."""
        return wrench, np.zeros_like(self.beads)

    def ways(self, beads: FloatArray) -> Column:
        """Return a column of the beads alone."""
        return np.zeros_like(self.wrench), beads

    def moved(self, motion: FloatArray) -> Column:
        """Return what a further motion (n, 6) of the gripper would add."""
        return motion @ self.stiffness.T, np.einsum("mak,nk->nma", self.shape, motion)


Template = Callable[[Fitted], list[Column]]


def _one(length: int, place: int) -> FloatArray:
    return np.eye(length)[place]


def _bias(f: Fitted) -> list[Column]:
    later = (np.arange(len(f.share)) > 0).astype(np.float64)
    return [f.forces(np.outer(later, _one(6, axis))) for axis in range(6)]


def _drift(f: Fitted) -> list[Column]:
    return [f.forces(np.outer(f.experiment.time - f.experiment.time[0], _one(6, axis))) for axis in range(6)]


def _axis_gain(f: Fitted) -> list[Column]:
    return [f.forces(f.wrench * _one(6, axis)) for axis in range(3)]


def _crosstalk(f: Fitted) -> list[Column]:
    pairs = [(i, j) for i in range(3) for j in range(6) if i != j]
    return [f.forces(np.outer(f.wrench[:, i], _one(6, j))) for i, j in pairs]


def _turned_sensor(f: Fitted) -> list[Column]:
    turned = [
        np.hstack([np.cross(_one(3, axis), f.wrench[:, :3]), np.cross(_one(3, axis), f.wrench[:, 3:])])
        for axis in range(3)
    ]
    return [f.forces(wrench) for wrench in turned]


def _lever(f: Fitted) -> list[Column]:
    zero = np.zeros((len(f.share), 3))
    return [f.forces(np.hstack([zero, np.cross(_one(3, axis), f.wrench[:, :3])])) for axis in range(3)]


def _tool_weight(f: Fitted) -> list[Column]:
    """A weight whose direction turns with the gripper; to first order, rotation vector times gravity."""
    down = np.array([0.0, 0.0, -9.81])
    tilt = np.cross(f.experiment.motion[:, 3:], down)
    zero = np.zeros_like(tilt)
    turned = [np.hstack([zero, np.cross(_one(3, axis), tilt)]) for axis in range(3)]
    return [f.forces(np.hstack([tilt, zero])), *map(f.forces, turned)]


def _late(f: Fitted) -> list[Column]:
    time = f.experiment.time
    return [
        f.forces(np.gradient(f.wrench, time, axis=0)),
        f.ways(np.gradient(f.beads, time, axis=0)),
    ]


def _camera_scale(f: Fitted) -> list[Column]:
    return [f.ways(f.beads), f.ways(np.broadcast_to(f.experiment.rest, f.beads.shape))]


def _camera_rotation(f: Fitted) -> list[Column]:
    here = f.experiment.rest + f.beads
    turns = [np.cross(_one(3, axis), here) for axis in range(3)]
    return [f.ways(turn) for turn in turns]


def _relaxing(f: Fitted) -> list[Column]:
    """The force that memory adds: the motion's rate, smoothed over two times."""
    time = f.experiment.time
    columns = []
    for constant in (_FAST_S, _SLOW_S):
        memory = np.zeros_like(f.wrench)
        for row in range(1, len(time)):
            fade = np.exp(-(time[row] - time[row - 1]) / constant)
            memory[row] = fade * memory[row - 1] + f.wrench[row] - f.wrench[row - 1]
        columns.append(f.forces(memory))
    return columns


def _softer_later(f: Fitted) -> list[Column]:
    return [f.forces(f.wrench * f.is_return[:, None]), f.forces(f.wrench * float(f.experiment.order - 1))]


def _set(f: Fitted) -> list[Column]:
    back = f.is_return[:, None]
    reached = np.argmax(f.share)
    return [
        f.forces(back * f.wrench[reached]),
        f.ways(back[:, :, None] * f.beads[reached]),
    ]


def _stiffening(f: Fitted) -> list[Column]:
    return [f.forces(f.wrench * f.share[:, None] ** 2), f.forces(f.wrench * f.share[:, None] ** 3)]


def _direction(f: Fitted) -> list[Column]:
    """Tissue that is stiffer one way: each force, and each spread of the beads, by itself."""
    return [
        *(f.forces(f.wrench * _one(6, axis)) for axis in (0, 1, 5)),
        *(f.ways(f.beads * _one(3, a)) for a in range(2)),
    ]


def _graded(f: Fitted) -> list[Column]:
    rest = f.experiment.rest / max(f.experiment.size)
    return [f.ways(f.beads * rest[None, :, axis, None]) for axis in range(2)]


def _local(f: Fitted) -> list[Column]:
    """A place of another stiffness: the beads' ways beside each of nine places change."""
    x, y = np.meshgrid([-0.25, 0.0, 0.25], [-0.25, 0.0, 0.25])
    places = np.column_stack([x.ravel() * f.experiment.size[0], y.ravel() * f.experiment.size[1]])
    width = 0.2 * max(f.experiment.size)
    near = [np.exp(-np.sum((f.experiment.rest[:, :2] - place) ** 2, axis=1) / width**2) for place in places]
    return [f.ways(f.beads * weight[None, :, None]) for weight in near]


def _yielding_anchor(f: Fitted) -> list[Column]:
    """All beads follow the force."""
    ones = np.ones(f.beads.shape[1])
    return [f.ways(np.einsum("n,m,a->nma", f.wrench[:, axis], ones, _one(3, axis))) for axis in range(3)]


def _loosening_anchor(f: Fitted) -> list[Column]:
    """The beads at the side opposite the grasp go along the more, the further the pull."""
    side = np.clip(
        -f.experiment.rest[:, 0] * np.sign(f.experiment.centre[0]) / f.experiment.size[0] + 0.5, 0, 1
    )
    along = np.einsum("na,m->nma", f.experiment.motion[:, :3] * f.share[:, None] ** 2, side)
    return [f.ways(along), f.forces(f.wrench * f.share[:, None])]


def _slip(f: Fitted) -> list[Column]:
    beyond = np.clip(f.share - 0.3, 0.0, None)
    held = np.maximum.accumulate(beyond)
    return [f.moved(f.experiment.motion * factor[:, None]) for factor in (beyond, held)]


def _yielding_gripper(f: Fitted) -> list[Column]:
    forces, torques = f.wrench.copy(), f.wrench.copy()
    forces[:, 3:], torques[:, :3] = 0.0, 0.0
    return [f.moved(forces), f.moved(torques)]


def _other_grasp(f: Fitted) -> list[Column]:
    """The tissue is held beside the stated place: levers change, and the beads with them."""
    columns = []
    for axis in range(2):
        further = np.zeros_like(f.experiment.motion)
        further[:, :3] = np.cross(f.experiment.motion[:, 3:], _one(3, axis))
        wrench, beads = f.moved(further)
        wrench = wrench + np.hstack([np.zeros((len(wrench), 3)), np.cross(_one(3, axis), f.wrench[:, :3])])
        columns.append((wrench, beads))
    return columns


def _motion_scale(f: Fitted) -> list[Column]:
    parts = [f.experiment.motion.copy() for _ in range(2)]
    parts[0][:, 3:], parts[1][:, :3] = 0.0, 0.0
    return [f.moved(part) for part in parts]


def _motion_direction(f: Fitted) -> list[Column]:
    turned = [
        np.hstack([np.cross(_one(3, axis), f.experiment.motion[:, :3]), np.zeros((len(f.share), 3))])
        for axis in range(3)
    ]
    return [f.moved(motion) for motion in turned]


def _backlash(f: Fitted) -> list[Column]:
    """The gripper is behind by a constant, whose sign is that of the latest motion."""
    columns = []
    for part in (slice(0, 3), slice(3, 6)):
        way = np.zeros_like(f.experiment.motion)
        steps = np.gradient(f.experiment.motion[:, part], axis=0)
        length = np.linalg.norm(steps, axis=1, keepdims=True)
        floor = 0.3 * float(np.median(length[length > 0])) if np.any(length > 0) else 1.0
        held = np.zeros(3)
        for row in range(len(way)):
            held = steps[row] / length[row, 0] if length[row, 0] > floor else held
            way[row, part] = held
        columns.append(f.moved(way))
    return columns


def _friction(f: Fitted) -> list[Column]:
    steps = np.sign(np.gradient(f.beads, axis=0))
    drag = np.sign(np.gradient(f.experiment.motion[:, :3], axis=0))
    return [f.ways(steps), f.forces(np.hstack([drag, np.zeros_like(drag)]))]


def _sagging(f: Fitted) -> list[Column]:
    later = np.ones(len(f.share))
    ends = 1.0 - (2 * f.experiment.rest[:, 0] / f.experiment.size[0]) ** 2
    return [
        f.ways(np.einsum("n,m,a->nma", later, ends, _one(3, 2))),
        f.ways(np.einsum("n,m,a->nma", f.share, ends, _one(3, 2))),
    ]


def _thickness(f: Fitted) -> list[Column]:
    return [f.forces(f.wrench * np.isin(np.arange(6), [2, 3, 4])), f.ways(f.beads * _one(3, 2))]


def _stretched_before(f: Fitted) -> list[Column]:
    """Tension along x stiffens what is moved across it."""
    across = f.experiment.motion * np.array([0, 1, 1, 0, 0, 0])
    return [f.forces(f.moved(across)[0]), f.forces(f.moved(across * f.share[:, None])[0])]


TEMPLATES: Mapping[str, Template] = {
    "strain_stiffening": _stiffening,
    "viscoelasticity": _relaxing,
    "stress_softening": _softer_later,
    "permanent_set": _set,
    "anisotropy": _direction,
    "inhomogeneity": _local,
    "modulus_gradient": _graded,
    "thickness_error": _thickness,
    "prestretch": _stretched_before,
    "anchor_compliance": _yielding_anchor,
    "anchor_debonding": _loosening_anchor,
    "grasp_misplacement": _other_grasp,
    "gripper_compliance": _yielding_gripper,
    "gripper_slip": _slip,
    "support_friction": _friction,
    "gravity_sag": _sagging,
    "motion_scale": _motion_scale,
    "motion_direction": _motion_direction,
    "robot_backlash": _backlash,
    "tool_weight": _tool_weight,
    "torque_centre": _lever,
    "force_frame_rotation": _turned_sensor,
    "force_crosstalk": _crosstalk,
    "force_axis_gain": _axis_gain,
    "force_bias": _bias,
    "force_drift": _drift,
    "time_offset": _late,
    "camera_scale": _camera_scale,
    "camera_rotation": _camera_rotation,
}
