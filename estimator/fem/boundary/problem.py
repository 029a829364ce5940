"""The retraction as a boundary value problem: a body, its anchors, its grasp and its fiducials."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.fem.assembly.body import Body, build_body
from estimator.fem.assembly.regions import StifferRegion
from estimator.fem.assembly.tangent import TangentPattern, shared_pattern
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.pins import pinned
from estimator.fem.boundary.prescribed import PrescribedMotion
from estimator.fem.discretisation.mesh import Mesh, interpolation_rows
from estimator.fem.discretisation.shares import nodal_weights

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

FIDUCIAL_TOLERANCE_M = 1e-3
"""How far a fiducial may lie off the tissue, m."""


@dataclass(frozen=True)
class RetractionProblem:
    """Everything about a retraction but the material and the motion.

    Attributes
    ----------
    body : Body
    fixed, gripped : (n,) bool, nodes that stand still, and nodes that move with the gripper
    anchored : (n,) bool, nodes of the anchored tissue; they stand still unless the anchor yields
    attachment : (n,) float64, what share of each of these holds
    grasp_centre : (3,) float64, origin of the gripper frame at rest, tissue frame, m
    fiducials_rest : (m, 3) float64, m
    fiducials_gripped : (m,) bool, fiducials on gripped tissue, which move rigidly
    fiducials_off : (m, 3) float64, from where these are said to be at rest to the tissue that they sit on, m
    fiducial_nodes, fiducial_weights : (m, k), interpolation of the others from nodes
    specific_weight : (3,) float64, weight that strains the tissue, N/m³
    rolling : (n, 3) bool, along which axes nodes stand still whatever else holds them; none where None
    grips_along : (3,) bool, along which axes gripped nodes move with the gripper; along the others they slide on it
    prescribed : of a part of the boundary whose motion was measured; it goes before what else holds it
    pressed : (n, 3) bool, degrees of freedom that stand still under the push of a plate on which the tissue rubs; none
        where None
    grips_patch : whether a patch of the surface is gripped, and no tissue below it
    regions : of the tissue that are stiffer or softer than the rest; the body has them already
    off_mesh_m : how far fiducials may lie off the mesh, m
    grip_core : (2, 3) corners of the box whose tissue is gripped and left out of the mesh of a surface, m; else None
    """

    body: Body
    fixed: BoolArray
    gripped: BoolArray
    anchored: BoolArray
    attachment: FloatArray
    grasp_centre: FloatArray
    fiducials_rest: FloatArray
    fiducials_gripped: BoolArray
    fiducials_off: FloatArray
    fiducial_nodes: IntArray
    fiducial_weights: FloatArray
    specific_weight: FloatArray = field(default_factory=lambda: np.zeros(3))
    rolling: BoolArray | None = None
    grips_along: BoolArray = field(default_factory=lambda: np.ones(3, dtype=bool))
    prescribed: PrescribedMotion | None = None
    pressed: BoolArray | None = None
    grips_patch: bool = False
    regions: tuple[StifferRegion, ...] = ()
    off_mesh_m: float = FIDUCIAL_TOLERANCE_M
    grip_core: FloatArray | None = None

    @property
    def grips_rigidly(self) -> bool:
        """Whether all that is imposed is the rigid motion of what the gripper holds."""
        return bool(self.grips_along.all()) and self.prescribed is None

    @property
    def heavy(self) -> bool:
        """Whether weight strains the tissue, so that forces are not proportional to its stiffness."""
        return bool(self.specific_weight.any())

    @cached_property
    def pattern(self) -> TangentPattern:
        """Where each element's entries go in the tangent."""
        return self._holding.pattern(self.body.mesh)

    @property
    def held(self) -> BoolArray:
        """Which degrees of freedom (n, 3) are held, whether they stand still or move."""
        return self._holding.held

    @property
    def _holding(self) -> HeldNodes:
        return HeldNodes(
            self.fixed, self.gripped, self.rolling, self.grips_along, self.prescribed, self.pressed
        )

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process needs: it analyses the pattern itself, sooner than it would be sent."""
        return {name: value for name, value in vars(self).items() if name != "pattern"}

    @cached_property
    def weight(self) -> FloatArray:
        """The weight (n, 3) of the tissue that belongs to each node, N."""
        return nodal_weights(self.body.mesh, self.specific_weight)

    def fiducial_positions(self, displacement: FloatArray, pose: GripperPose) -> FloatArray:
        """Return the positions (m, 3) of the fiducials, m, at nodal displacements (n, 3) and the gripper's pose."""
        moved = np.einsum("mk,mkx->mx", self.fiducial_weights, displacement[self.fiducial_nodes])
        positions = self.fiducials_rest + moved
        held = self.fiducials_gripped
        arms = self.gripped_fiducial_arms()
        positions[held] = pose.position + pose.rotation.apply(arms) - self.fiducials_off[held]
        return positions

    def gripped_fiducial_arms(self) -> FloatArray:
        """Return where in the gripper frame the tissue is on which gripped fiducials sit, (g, 3), m."""
        held = self.fiducials_gripped
        return self.fiducials_rest[held] + self.fiducials_off[held] - self.grasp_centre

    def gripped_positions(self, pose: GripperPose) -> FloatArray:
        """Return the positions (g, 3) of the gripped nodes, m, when the gripper frame is at ``pose``."""
        arms = self.body.mesh.points[self.gripped] - self.grasp_centre
        return pose.position + pose.rotation.apply(arms)

    def imposed(self, displacement: FloatArray, pose: GripperPose) -> FloatArray:
        """Return nodal displacements (n, 3), m, with what the gripper imposes when its frame is at ``pose``."""
        held = np.outer(self.gripped, self.grips_along)
        moved = displacement.copy()
        way = self.gripped_positions(pose) - self.body.mesh.points[self.gripped]
        moved[held] = way[:, self.grips_along].ravel()
        if self.prescribed is not None:
            moved[self.prescribed.led] = self.prescribed.displacement(pose.position)
        return moved


@dataclass(frozen=True)
class HeldNodes:
    """Which of the n nodes of a mesh are held, and along which axes.

    Attributes
    ----------
    fixed, gripped : (n,) bool, nodes that stand still, and nodes that move with the gripper
    rolling : (n, 3) bool, along which axes nodes stand still whatever else holds them; none where None
    grips_along : (3,) bool, along which axes gripped nodes move with the gripper
    prescribed : of a part of the boundary whose motion was measured
    pressed : (n, 3) bool, degrees of freedom that a plate holds on which the tissue rubs; none where None
    """

    fixed: BoolArray
    gripped: BoolArray
    rolling: BoolArray | None = None
    grips_along: BoolArray = field(default_factory=lambda: np.ones(3, dtype=bool))
    prescribed: PrescribedMotion | None = None
    pressed: BoolArray | None = None

    @property
    def held(self) -> BoolArray:
        """Which degrees of freedom (n, 3) stand still or move."""
        return self._still | self._moved

    def pattern(self, mesh: Mesh) -> TangentPattern:
        """Analyse a mesh whose nodes are held so."""
        return shared_pattern(mesh, self._still, self._moved)

    def kept_from_drifting(self, points: FloatArray) -> HeldNodes:
        """Return the same with pins where a body with these nodes (n, 3) could move as a whole."""
        if self.gripped.any() and self.grips_along.all():
            return self
        pins = pinned(points, self.held)
        if not pins.any():
            return self
        return replace(self, rolling=pins if self.rolling is None else self.rolling | pins)

    @property
    def _moved(self) -> BoolArray:
        """Which degrees of freedom (n, 3) move as the gripper, or what was measured, has it.

        Those that are pressed go with them, though they stay: what rubs has to know their forces.
        """
        moved = np.outer(self.gripped, self.grips_along)
        if self.pressed is not None:
            moved |= self.pressed
        return moved if self.prescribed is None else moved | self.prescribed.led

    @property
    def _still(self) -> BoolArray:
        """Which degrees of freedom (n, 3) stand still."""
        still = np.repeat(self.fixed[:, None], 3, axis=1)
        return still if self.rolling is None else still | self.rolling


def retraction_problem(
    mesh: Mesh,
    held: HeldNodes,
    grasp_centre: FloatArray,
    fiducials_rest: FloatArray,
    fiducials_gripped: BoolArray,
    off_mesh_m: float = FIDUCIAL_TOLERANCE_M,
) -> RetractionProblem:
    """Pose a retraction on a mesh, of tissue without weight; gripped nodes that are anchored as well count as gripped.

    Fiducials may lie off the mesh by ``off_mesh_m``.

    Raises
    ------
    InputError
        No node is anchored or none is gripped, or a fiducial lies off the tissue.
    """
    if not held.gripped.any():
        raise InputError("the grasp box holds no tissue; correct [grasp] box")
    held = replace(held, fixed=held.fixed & ~held.gripped).kept_from_drifting(mesh.points)
    if not held.fixed.any() and held.rolling is None and held.prescribed is None:
        raise InputError("no anchor box holds tissue; correct [[anchor]] box")
    if not len(held.pattern(mesh).free):
        raise InputError("all of the tissue is held, so that nothing is left to deform; give smaller boxes")
    count = mesh.cells.shape[1]
    nodes = np.zeros((len(fiducials_rest), count), dtype=np.int64)
    weights = np.zeros((len(fiducials_rest), count))
    loose = ~fiducials_gripped
    nodes[loose], weights[loose] = interpolation_rows(mesh, fiducials_rest[loose], off_mesh_m)
    return RetractionProblem(
        build_body(mesh),
        held.fixed,
        held.gripped,
        held.fixed,
        held.fixed.astype(float),
        grasp_centre,
        fiducials_rest,
        fiducials_gripped,
        np.zeros_like(fiducials_rest),
        nodes,
        weights,
        rolling=held.rolling,
        grips_along=held.grips_along,
        prescribed=held.prescribed,
        off_mesh_m=off_mesh_m,
    )
