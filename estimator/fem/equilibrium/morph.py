"""Meshes of another rest shape with the same elements: nodes moved, grasp and anchors still on mesh planes."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from estimator.experiment import Box
from estimator.fem.assembly.body import build_body
from estimator.fem.assembly.regions import with_regions_in_place
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.patch import from_patch, on_patch
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.mesh import interpolation_rows
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.state import linear_change
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# Grasp and border this close (as a share of the phantom's length) are one.
_TOUCHING = 0.02
# How much farther than at first a bead may lie off the faceted surface, m.
_FARTHER_M = 1e-3
_SOFT_TISSUE = Material(NeoHookean(), 1e4, 0.45)
# A bead on the rim of the grasp counts as gripped, m.
_RIM_M = 1e-9


@dataclass(frozen=True)
class Taper:
    """One on the grasp, falling linearly to zero at the phantom's borders, along one axis.

    Along the axis in which points move, a border that the grasp touches stands still as well: ``across`` then falls
    to zero there, from the grasp's other side. Beside such a border points may slide along it: ``along`` does not.

    Attributes
    ----------
    lower, upper : of the grasp, m
    least, most : of the phantom, m
    """

    lower: float
    upper: float
    least: float
    most: float

    @property
    def touches_lower(self) -> bool:
        """Whether the grasp reaches the lower border."""
        return self.lower - self.least < _TOUCHING * (self.most - self.least)

    @property
    def touches_upper(self) -> bool:
        """Whether the grasp reaches the upper border."""
        return self.most - self.upper < _TOUCHING * (self.most - self.least)

    def along(self, x: FloatArray) -> FloatArray:
        """Return the weight of a motion at right angles to this axis."""
        weight: FloatArray = np.ones_like(x)
        if not self.touches_lower:
            weight = np.minimum(weight, (x - self.least) / (self.lower - self.least))
        if not self.touches_upper:
            weight = np.minimum(weight, (self.most - x) / (self.most - self.upper))
        return np.clip(weight, 0.0, 1.0)

    def across(self, x: FloatArray) -> FloatArray:
        """Return the weight of a motion along this axis."""
        if self.upper - self.lower < _TOUCHING * (self.most - self.least):
            # All tissue beyond is gripped and left out of the mesh: its face moves.
            return self.along(x)
        if self.touches_lower and self.touches_upper:
            return np.zeros_like(x)
        weight = self.along(x)
        if self.touches_lower:
            weight = np.minimum(weight, (x - self.least) / (self.upper - self.least))
        if self.touches_upper:
            weight = np.minimum(weight, (self.most - x) / (self.most - self.lower))
        return np.clip(weight, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class OffAnchors:
    """One, falling linearly to zero at the anchors: those of a block lie on its border, where tapers end anyway.

    Attributes
    ----------
    anchored : of the nodes of an organ's anchors; None for a block
    reach : from which distance on it is one, m
    """

    anchored: KDTree | None
    reach: float

    @classmethod
    def of(cls, problem: RetractionProblem) -> "OffAnchors":
        """Return that of a problem: it is one in all of its grasp."""
        mesh = problem.body.mesh
        if not mesh.kind.startswith("tet") or not problem.anchored.any():
            return cls(None, 0.0)
        anchored = KDTree(mesh.points[problem.anchored])
        away, _ = anchored.query(mesh.points[problem.gripped])
        return cls(anchored, float(np.min(away)))

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the weight (n,) of a motion at points (n, 3)."""
        if self.anchored is None or not self.reach:
            return np.ones(len(points))
        return np.clip(self.anchored.query(points)[0] / self.reach, 0.0, 1.0)


def grasp_box(problem: RetractionProblem) -> FloatArray:
    """Return the corners (2, 3) of the smallest box around the gripped nodes, m."""
    gripped = problem.body.mesh.points[problem.gripped]
    return np.stack([gripped.min(axis=0), gripped.max(axis=0)])


def beads_from_grasp(problem: RetractionProblem) -> FloatArray:
    """Return how far the tissue that each bead sits on is from the grasp, (m,), m; 0 for gripped tissue."""
    points = problem.body.mesh.points[problem.fiducial_nodes]
    places = np.einsum("mk,mkx->mx", problem.fiducial_weights, points)
    if problem.grips_patch:
        away = from_patch(problem.body.mesh, problem.gripped, places)
    else:
        lower, upper = grasp_box(problem)
        away = Box(tuple(lower), tuple(upper)).distance(places)
    return np.where(problem.fiducials_gripped, 0.0, away)


def tapers(problem: RetractionProblem) -> tuple[Taper, Taper]:
    """Return the tapers along x and y."""
    points, box = problem.body.mesh.points, grasp_box(problem)
    least, most = points.min(axis=0), points.max(axis=0)
    first, second = (Taper(box[0, a], box[1, a], least[a], most[a]) for a in range(2))
    return first, second


def with_points(problem: RetractionProblem, points: FloatArray) -> RetractionProblem:
    """Return the problem with other rest positions (n, 3) of its nodes, m.

    Beads, and regions of another stiffness, stay with their elements.
    """
    mesh = replace(problem.body.mesh, points=points)
    return replace(problem, body=build_body(mesh, problem.body.modulus))


def with_grasp_moved(
    problem: RetractionProblem, shift_m: FloatArray, turn_rad: float, wider_m: FloatArray
) -> RetractionProblem:
    """Return the problem whose grasped region lies elsewhere: shifted (2,) and turned about z at the grasp's centre.

    Each of its edges may lie farther out than stated besides, by ``wider_m`` (2,) along x and along y. The outline of a
    block, the anchors, the beads and regions of another stiffness stay where they are.
    """
    first, second = tapers(problem)
    off_anchors = OffAnchors.of(problem)
    lower, upper = grasp_box(problem)[:, :2]
    # A grasp that is a face has no edges along its normal: nothing of it lies farther out there.
    extent = np.where(upper > lower, upper - lower, np.inf)

    def motion(points: FloatArray) -> FloatArray:
        outward = wider_m * np.clip((2.0 * points[:, :2] - lower - upper) / extent, -1.0, 1.0)
        arms = points[:, :2] - problem.grasp_centre[:2]
        cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
        rigid = shift_m + arms @ (np.array([[cosine, sine], [-sine, cosine]]) - np.eye(2))
        x, y = points[:, 0], points[:, 1]
        along_x, across_x = first.along(x), first.across(x)
        along_y, across_y = second.along(y), second.across(y)
        # What a border keeps from turning with the rest slides along it, between the sides of the turned grasp.
        slide_x = np.tan(turn_rad) * (along_y - across_y) * rigid[:, 1]
        slide_y = -np.tan(turn_rad) * (along_x - across_x) * rigid[:, 0]
        moved: FloatArray = np.zeros_like(points)
        moved[:, 0] = across_x * (along_y * (rigid[:, 0] + outward[:, 0]) + slide_x)
        moved[:, 1] = across_y * (along_x * (rigid[:, 1] + outward[:, 1]) + slide_y)
        return moved * off_anchors(points)[:, None]

    moved = _with_motion(problem, motion(problem.body.mesh.points))
    moved = replace(moved, body=with_regions_in_place(moved.body, problem.body, problem.regions))
    origins = problem.fiducials_rest.copy()
    for _ in range(8):
        origins = problem.fiducials_rest - motion(origins)
    return _with_beads_located(moved, _in_grasp(problem, origins))


def with_grasp_drawn(problem: RetractionProblem, way_m: FloatArray) -> RetractionProblem:
    """Return the problem whose tissue is drawn (2,) at the grasp, less and less towards borders and anchors.

    Beads are carried along.
    """
    first, second = tapers(problem)
    off_anchors = OffAnchors.of(problem)
    way = np.array([*way_m, 0.0])

    def motion(points: FloatArray) -> FloatArray:
        weight = first.along(points[:, 0]) * second.along(points[:, 1]) * off_anchors(points)
        return np.asarray(weight[:, None] * way)

    drawn = _with_motion(problem, motion(problem.body.mesh.points))
    return replace(drawn, fiducials_rest=problem.fiducials_rest + motion(problem.fiducials_rest))


def with_beads_before_drawing(problem: RetractionProblem, way_m: FloatArray) -> RetractionProblem:
    """Return the problem whose beads lie where they are stated only once the grasp has been drawn (2,), m.

    The phantom's shape is left as it is, free of stress before it was drawn; how the tissue follows the grasp is that
    of linear elasticity, on which E has no influence and ν little. A bead stated in the grasp may have come there from
    beside it.
    """
    rest = EquilibriumSolver(problem).rest(_SOFT_TISSUE)
    way = np.array([*way_m, 0.0])
    displacement = linear_change(problem, rest, np.concatenate([way, np.zeros(3)]))
    return with_beads_before(
        problem, displacement, GripperPose(problem.grasp_centre + way, Rotation.identity())
    )


def with_beads_before(
    problem: RetractionProblem, displacement: FloatArray, pose: GripperPose
) -> RetractionProblem:
    """Return the problem whose beads lie where they are stated only once the tissue has moved.

    Those that would come from outside the tissue stay near its surface.

    Parameters
    ----------
    displacement : (n, 3) of the nodes then, m
    pose : of the gripper then
    """
    placed = problem
    for _ in range(3):
        moved = placed.fiducial_positions(displacement, pose) - placed.fiducials_rest
        placed = with_beads_at(placed, problem.fiducials_rest - moved)
    return placed


def with_beads_at(problem: RetractionProblem, positions: FloatArray) -> RetractionProblem:
    """Return the problem with its beads at other rest positions (m, 3), m; any outside the tissue near its surface."""
    first, last = problem.body.mesh.points.min(axis=0), problem.body.mesh.points.max(axis=0)
    outside = _FARTHER_M
    placed = replace(problem, fiducials_rest=np.clip(positions, first - outside, last + outside))
    # One a little above the surface of gripped tissue sits on that.
    return _with_beads_located(placed, _in_grasp(problem, np.clip(positions, first, last)))


def _with_motion(problem: RetractionProblem, motion: FloatArray) -> RetractionProblem:
    """Return the problem with its nodes moved (n, 3), but for those of the anchors."""
    return with_points(problem, problem.body.mesh.points + np.where(problem.anchored[:, None], 0.0, motion))


def _with_beads_located(problem: RetractionProblem, gripped: NDArray[np.bool_]) -> RetractionProblem:
    """Find the elements of beads anew; those in tissue that an anchor holds follow no node, before and after."""
    nodes, weights = problem.fiducial_nodes.copy(), problem.fiducial_weights.copy()
    in_anchor = ~problem.fiducials_gripped & ~weights.any(axis=1)
    loose = ~(gripped | in_anchor)
    weights[gripped] = 0.0
    beads = problem.fiducials_rest[loose]
    mesh = problem.body.mesh
    # One that would come from beside an organ's curved skin sits on that: no box tells where it is.
    farthest = np.inf if mesh.kind.startswith("tet") else problem.off_mesh_m + _FARTHER_M
    nodes[loose], weights[loose] = interpolation_rows(mesh, beads, farthest)
    return replace(
        problem, fiducials_gripped=gripped & ~in_anchor, fiducial_nodes=nodes, fiducial_weights=weights
    )


def _in_grasp(problem: RetractionProblem, points: FloatArray) -> NDArray[np.bool_]:
    """Tell of points (m, 3), m, whether they lie in gripped tissue, or on the gripped patch."""
    if problem.grips_patch:
        return on_patch(problem.body.mesh, problem.gripped, points, problem.off_mesh_m)
    found = _in_box(points, grasp_box(problem))
    # walls of a lobe's tip end within the tissue: the box of their nodes does not hold all of the tip
    return found if problem.grip_core is None else found | _in_box(points, problem.grip_core)


def _in_box(points: FloatArray, corners: FloatArray) -> NDArray[np.bool_]:
    return np.asarray(np.all((points >= corners[0] - _RIM_M) & (points <= corners[1] + _RIM_M), axis=1))
