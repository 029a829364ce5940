"""Two parallel plates between which a body is pressed: one that stands, and the gripper's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.shares import nodal_areas
from estimator.fem.discretisation.surface import boundary_faces

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

# Nodes this close to a plane, as a share of the body's extent, lie in it.
_IN_PLANE = 1e-6
# Of what the middle of a quadratic triangle's edge bears goes to its two ends, which by themselves bear nothing: so all
# nodes of an even mesh bear the same.
_TO_CORNERS = 0.25


@dataclass(frozen=True, eq=False)
class Platens:
    """The plates, and the nodes (n,) that they hold.

    Attributes
    ----------
    mesh : of the body
    axis : of their normal
    standing, moving : (n,) bool, nodes on the plate that stands, and on the gripper's
    grasp_centre : (3,) origin of the gripper frame at rest, m
    """

    mesh: Mesh
    axis: int
    standing: BoolArray
    moving: BoolArray
    grasp_centre: FloatArray

    @cached_property
    def area(self) -> FloatArray:
        """The area (n,) of each plate that belongs to each node, m², none of which is zero."""
        found = np.zeros(len(self.mesh.points))
        for nodes in (self.standing, self.moving):
            area, _ = nodal_areas(self.mesh, self._faces(nodes))
            found += area
        return np.asarray(self._shared @ found)

    @cached_property
    def pressing(self) -> csr_array:
        """What presses at each node, (n, 3n), by the nodal forces of the tissue: those that push into it."""
        inward = self.moving.astype(float) - self.standing
        points = self.mesh.points[:, self.axis]
        inward *= np.sign(points[self.standing].mean() - points[self.moving].mean())
        nodes = np.flatnonzero(inward)
        push = csr_array(
            (inward[nodes], (nodes, 3 * nodes + self.axis)), shape=(len(inward), 3 * len(inward))
        )
        return csr_array(self._shared @ push)

    def carried(self, position: FloatArray, rotation: Rotation) -> FloatArray:
        """Return how far (n, 3), m, the gripper's plate carries what sticks to it.

        Its frame's origin is at ``position`` (3,), m, and turned from rest by ``rotation``.
        """
        way, points = np.zeros_like(self.mesh.points), self.mesh.points[self.moving]
        way[self.moving] = position + rotation.apply(points - self.grasp_centre) - points
        return way

    @cached_property
    def _shared(self) -> csr_array:
        """How what belongs to each node by its shape function is shared among its neighbours, (n, n)."""
        count = len(self.mesh.points)
        faces = np.concatenate([self._faces(self.standing), self._faces(self.moving)])
        if faces.shape[1] != 6:
            return _identity(count)
        edges = faces[:, [[3, 0, 1], [4, 1, 2], [5, 2, 0]]].reshape(-1, 3)
        edges = np.unique(edges, axis=0)
        edges = edges[np.unique(edges[:, 0], return_index=True)[1]]
        middle, ends = edges[:, :1].repeat(2, axis=1), edges[:, 1:]
        rows = np.concatenate([np.arange(count), ends.ravel()])
        columns = np.concatenate([np.arange(count), middle.ravel()])
        own = np.ones(count)
        own[edges[:, 0]] = 1.0 - _TO_CORNERS
        values = np.concatenate([own, np.full(ends.size, _TO_CORNERS / 2)])
        return csr_array((values, (rows, columns)), shape=(count, count))

    def _faces(self, nodes: BoolArray) -> IntArray:
        faces = boundary_faces(self.mesh)
        return faces[nodes[faces].all(axis=1)]


def platens_of(problem: RetractionProblem) -> Platens | None:
    """Return the plates between which a problem's body is held; None where it is not held by two parallel faces.

    The grasp has to be one whole end of the body, the anchors the other, both at right angles to the same axis.
    """
    mesh, gripped, anchored = problem.body.mesh, problem.gripped, problem.anchored
    if problem.prescribed is not None or not (gripped.any() and anchored.any()):
        return None
    for axis in range(3):
        along = mesh.points[:, axis]
        near = _IN_PLANE * float(np.ptp(along))
        low, high = along < along.min() + near, along > along.max() - near
        for standing, moving in ((low, high), (high, low)):
            if np.array_equal(gripped, moving) and np.array_equal(anchored, standing):
                return Platens(mesh, axis, anchored, gripped, problem.grasp_centre)
    return None


def held_along_normal(problem: RetractionProblem, platens: Platens, nodes: BoolArray) -> RetractionProblem:
    """Return the problem whose nodes (n,) on the plates are held along the plates' normal alone."""
    normal = np.arange(3) == platens.axis
    standing = nodes & platens.standing & problem.fixed
    moving = (nodes & platens.moving & problem.gripped).any()
    return replace(
        problem,
        fixed=problem.fixed & ~standing,
        pressed=np.outer(standing, normal),
        grips_along=problem.grips_along & normal if moving else problem.grips_along,
    )


def _identity(count: int) -> csr_array:
    return csr_array((np.ones(count), (np.arange(count), np.arange(count))), shape=(count, count))
