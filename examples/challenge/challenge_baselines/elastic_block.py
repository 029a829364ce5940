"""A block of linear elastic tissue, E = 1 Pa, by FElupe: what it answers to the six small motions of its gripper."""

from dataclasses import dataclass
from itertools import pairwise

import felupe
import numpy as np
from scipy.sparse.linalg import splu

from challenge_baselines.case_folder import Experiment, FloatArray

_CELL_M = 0.009
_CLOSE_M = 1.5e-3


@dataclass(frozen=True)
class Answer:
    """Of a block with one Poisson's ratio and E = 1 Pa.

    Attributes
    ----------
    wrench : (6, 6) that the tissue exerts on the gripper by each unit motion of it, about its centre
    beads : (m, 3, 6) way of each bead
    """

    wrench: FloatArray
    beads: FloatArray


def answers_of_block(experiment: Experiment, ratios: tuple[float, ...]) -> list[Answer]:
    """Return what the body of an experiment, taken for its bounding box, answers for some Poisson's ratios."""
    lines = [_grid_lines(experiment, axis) for axis in range(3)]
    mesh = felupe.mesh.convert(
        felupe.Grid(*lines), order=2, calc_points=True, calc_midfaces=False, calc_midvolumes=False
    )
    points = mesh.points
    field = felupe.FieldContainer([felupe.Field(felupe.RegionQuadraticHexahedron(mesh), dim=3)])
    gripped = _within(points, experiment.grasp)
    anchored = np.any([_within(points, box) for box in experiment.anchors], axis=0)
    prescribed = np.repeat(gripped | anchored, 3)
    arms = points[gripped] - experiment.centre
    motion = np.zeros((len(points), 3, 6))
    for axis in range(3):
        motion[gripped, axis, axis] = 1.0
        motion[gripped, :, 3 + axis] = np.cross(np.eye(3)[axis], arms)
    free, nearest = np.flatnonzero(~prescribed), _interpolation(points, mesh.cells, experiment.rest)
    found = []
    for ratio in ratios:
        body = felupe.SolidBody(felupe.LinearElastic(E=1.0, nu=ratio), field)
        stiffness = body.assemble.matrix().tocsc()
        moved = motion.reshape(-1, 6).copy()
        moved[free] = splu(stiffness[free][:, free]).solve(-(stiffness @ moved)[free])
        forces = -(stiffness @ moved).reshape(-1, 3, 6)[gripped]
        torques = np.cross(arms[:, :, None], forces, axis=1)
        wrench = np.vstack([forces.sum(axis=0), torques.sum(axis=0)])
        found.append(Answer(wrench, np.einsum("mp,pak->mak", nearest, moved.reshape(-1, 3, 6))))
    return found


def _grid_lines(experiment: Experiment, axis: int) -> FloatArray:
    """Return coordinates of grid lines along an axis, those where a box ends among them."""
    half = experiment.size[axis] / 2
    edges = np.concatenate([box[:, axis] for box in (*experiment.anchors, experiment.grasp)])
    marks = [-half, *(float(edge) for edge in sorted(edges) if abs(edge) < half - _CLOSE_M), half]
    kept = [marks[0]]
    kept += [mark for before, mark in pairwise(marks) if mark - before > _CLOSE_M]
    if kept[-1] < half:
        kept[-1] = half
    lines = [np.array(kept[:1])]
    for low, high in pairwise(kept):
        count = max(1, round((high - low) / _CELL_M), 2 if len(kept) == 2 else 1)
        lines.append(np.linspace(low, high, count + 1)[1:])
    return np.concatenate(lines)


def _within(points: FloatArray, box: FloatArray) -> np.ndarray:
    return np.all((points >= box[0] - 1e-4) & (points <= box[1] + 1e-4), axis=1)


def _interpolation(points: FloatArray, cells: np.ndarray, places: FloatArray) -> FloatArray:
    """Return weights (m, points) that give a field at some places, by the shape functions of their cells."""
    weights = np.zeros((len(places), len(points)))
    low, high = points[cells].min(axis=1), points[cells].max(axis=1)
    element = felupe.element.QuadraticHexahedron()
    for number, place in enumerate(places):
        own = int(np.argmin(np.sum(np.clip(np.maximum(low - place, place - high), 0.0, None), axis=1)))
        inside = np.clip((2 * place - low[own] - high[own]) / (high[own] - low[own]), -1.0, 1.0)
        weights[number, cells[own]] = element.function(inside)
    return weights
