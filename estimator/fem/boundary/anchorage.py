"""Anchors that yield: the anchored surface, and the problem with some of its nodes set free."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.shares import nodal_areas
from estimator.fem.discretisation.surface import boundary_faces

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

# Nodes above each other differ by less than this in their direction from the phantom's middle, rad.
_ABOVE_EACH_OTHER = 1e-6
# Stiffness of a node that is attached by half, over modulus times the root of its area: with it the gripping force
# falls evenly as more and more comes off, on coarse and fine meshes.
_HALF_ATTACHED = 0.3


def anchored_areas(problem: RetractionProblem) -> tuple[FloatArray, FloatArray]:
    """Return the anchored area (n,), m², of each node, and the dyad (n, 3, 3) of its normals over that area.

    A face counts where all of its nodes are held and one of them at least by an anchor; what the gripper holds is
    none of the anchors'.
    """
    anchored = problem.anchored
    faces = boundary_faces(problem.body.mesh)
    held = (anchored | problem.gripped)[faces].all(axis=1) & anchored[faces].any(axis=1)
    area, normals = nodal_areas(problem.body.mesh, faces[held])
    # corners of quadratic triangles have none, but for rounding
    return np.where(anchored, np.maximum(area, 0.0), 0.0), np.where(anchored[:, None, None], normals, 0.0)


def set_free(
    problem: RetractionProblem, freed: BoolArray, attachment: FloatArray | None = None
) -> RetractionProblem:
    """Return the problem whose nodes ``freed`` (n,) no longer stand still, with another attachment where given."""
    fixed = problem.fixed & ~freed
    return replace(
        problem,
        fixed=fixed,
        attachment=problem.attachment if attachment is None else attachment,
    )


@dataclass(frozen=True, eq=False)
class Rim:
    """The anchored nodes in columns along the rim, whose places go by anchored area from 0 to 1.

    The rim begins at its widest gap and goes anticlockwise about z.

    Attributes
    ----------
    anchored : (n,) bool, the nodes
    area : (n,) anchored area of each, m²
    column : (m,) of each anchored node
    start, end : (c,) of each column
    """

    anchored: BoolArray
    area: FloatArray
    column: IntArray
    start: FloatArray
    end: FloatArray

    @property
    def place(self) -> FloatArray:
        """The place (n,) of each anchored node, from 0 to 1; 0 elsewhere."""
        place: FloatArray = np.zeros(len(self.anchored))
        place[self.anchored] = ((self.start + self.end) / 2)[self.column]
        return place

    def attached(self, share: float, place: float) -> FloatArray:
        """Return how much (n,) of each node's anchored area stays attached once a share of the rim has come off.

        The place of the stretch that is off is 0 at one end of the rim and 1 at the other.
        """
        attached: FloatArray = np.ones(len(self.anchored))
        start, end = self.start, self.end
        first = place * (1.0 - share)
        lost = np.clip(np.minimum(end, first + share) - np.maximum(start, first), 0.0, None)
        middle = (start + end) / 2
        inside = (middle > first) & (middle < first + share)
        width = end - start
        lost = np.where(width > 1e-9, lost / np.maximum(width, 1e-9), inside)
        kept = np.where(lost < 1e-9, 1.0, np.clip(1.0 - lost, 0.0, 1.0))
        attached[self.anchored] = kept[self.column]
        return attached


def rim_of(problem: RetractionProblem) -> Rim:
    """Return the rim of a problem's anchors."""
    area, _ = anchored_areas(problem)
    column = _columns(problem.body.mesh.points[problem.anchored, :2])
    end = np.cumsum(np.bincount(column, area[problem.anchored]))
    start = np.concatenate([[0.0], end[:-1]])
    return Rim(problem.anchored, area, column, start / end[-1], end / end[-1])


def _columns(points: FloatArray) -> IntArray:
    """Number points (n, 2) along the rim: by direction from the middle, from the widest gap on."""
    direction = np.arctan2(points[:, 1], points[:, 0])
    ordered = np.sort(direction)
    gaps = np.diff(ordered, append=ordered[0] + 2 * np.pi)
    begin = ordered[(int(np.argmax(gaps)) + 1) % len(ordered)]
    along = np.round(np.mod(direction - begin + _ABOVE_EACH_OTHER / 2, 2 * np.pi) / _ABOVE_EACH_OTHER)
    return np.unique(along, return_inverse=True)[1]


def springs_of_partly_attached(area: FloatArray, share: FloatArray, modulus: float) -> FloatArray:
    """Return springs (n, 3, 3), N/m, that hold the nodes of which a share (n,) is attached in tissue of a modulus, Pa.

    They are rigid once all of a node is attached; none where nothing is, and where the whole is it needs none.
    ``area`` (n,) is the anchored one, m².
    """
    partly = (share > 0.0) & (share < 1.0)
    stiffness = np.zeros(len(share))
    stiffness[partly] = _HALF_ATTACHED * modulus * np.sqrt(area[partly])
    stiffness[partly] *= share[partly] / (1.0 - share[partly])
    return np.asarray(stiffness[:, None, None] * np.eye(3))
