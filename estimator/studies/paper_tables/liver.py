"""Section VI: a surface in the manner of a liver."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Box, Experiment, Grasp, Phantom
from estimator.fem.boundary.patch import on_patch
from estimator.fem.boundary.problem import (
    FIDUCIAL_TOLERANCE_M,
    HeldNodes,
    RetractionProblem,
    retraction_problem,
)
from estimator.fem.discretisation.mesh import Mesh
from estimator.forward.gradings import FINE_GRADING
from estimator.forward.meshing import held_regions, surface_problem
from estimator.forward.regions import with_regions
from estimator.geometry.grading import EdgeLengths
from estimator.geometry.mesh_cache import tissue_mesh
from estimator.geometry.organ import organ_surface
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.studies.paper_tables.block import Motion, measured, unmeasured
from estimator.studies.paper_tables.figures import LIVER, LIVER_FIDUCIALS_M, LIVER_FORCE_N, LIVER_TRUTH
from estimator.studies.paper_tables.fitting import fitted, row_of
from estimator.studies.paper_tables.grasp_error import Way
from estimator.studies.paper_tables.paper_method import estimate_by_paper
from estimator.studies.paper_tables.response import solve_response
from estimator.studies.running.case import Parametric, Row
from estimator.studies.tables.figure import Figure
from estimator.studies.tables.study import Group, Level, Study, Truth
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

YOUNGS_MODULUS, POISSON_RATIO = LIVER_TRUTH
# Of a bounding box of this length along x; neither size nor motion is given.
LENGTH_M = 0.20
# About 2803 and 1033 nodes of linear tetrahedra, as the paper has them.
_DATA_EDGE_M, _MODEL_EDGE_M = 8.6e-3, 12.8e-3
# Shares of the length along x that the anchor and the grasp hold, at the thick end and at the thin one.
_ANCHORED, _GRIPPED = 0.2, 0.12
_BEADS = 16
_RATIOS = (0.0, 0.1, 0.2, 0.28, 0.34, 0.4, 0.45, 0.48, 0.495)
LIVER_MOTIONS = {"pull": ("pull of 20 mm", Motion(10, 2e-3)), "far": ("pull of 60 mm", Motion(15, 4e-3))}


@dataclass(frozen=True)
class Liver(Parametric):
    """One estimate from one motion of one surface."""

    motion: str
    seed: int
    way: Way = "paper"
    subdivisions: int = 4

    @property
    def name(self) -> str:
        """What is retracted, and how."""
        return f"liver {self.seed}, {LIVER_MOTIONS[self.motion][0]}, {self.way}"

    def run(self) -> Row:
        """Retract on a finer mesh and estimate on a coarser one."""
        surface = organ_surface(self.seed, LENGTH_M, self.subdivisions)
        return retracted(liver_experiment(surface, LIVER_MOTIONS[self.motion][1]), surface, self.way)


def retracted(planned: Experiment, surface: Surface, way: Way) -> Row:
    """Retract a surface on a finer mesh and estimate on a coarser one, the paper's way or ours.

    Raises
    ------
    EstimatorError
        There is no estimate.
    """
    truth = Material(NeoHookean(), YOUNGS_MODULUS, POISSON_RATIO)
    if way == "ours":
        seen = measured(planned, surface_problem(planned, surface, FINE_GRADING), truth)
        model = surface_problem(planned, surface)
        return row_of(fitted(model, [seen]), remark=_remark(seen, model))
    larger = float(np.ptp(surface.bounds, axis=0).max()) / LENGTH_M
    seen = measured(planned, linear_problem(planned, surface, larger * _DATA_EDGE_M), truth)
    model = linear_problem(planned, surface, larger * _MODEL_EDGE_M)
    found = estimate_by_paper([solve_response(model, planned, _RATIOS)], [seen])
    return found.row(remark=_remark(seen, model))


def _remark(seen: Experiment, model: RetractionProblem) -> str:
    mesh = model.body.mesh
    force = float(np.linalg.norm(seen.wrench[:, :3], axis=1).max())
    return f"{len(mesh.points)} nodes, {len(mesh.cells)} {mesh.kind}; largest force {force:.1f} N"


def linear_problem(experiment: Experiment, surface: Surface, edge_m: float) -> RetractionProblem:
    """Pose a retraction of a surface on linear tetrahedra of about one size."""
    regions = held_regions(experiment, surface)
    tissue = tissue_mesh(surface, regions, EdgeLengths(edge_m, dict.fromkeys(regions, edge_m), 0.5))
    cells = tissue.mesh.cells[:, :4]
    corners, renumbered = np.unique(cells, return_inverse=True)
    mesh = Mesh(tissue.mesh.points[corners], renumbered.reshape(cells.shape), "tet4")
    held = {name: nodes[corners] for name, nodes in tissue.held.items()}
    fixed = np.any([nodes for name, nodes in held.items() if name != "grasp"], axis=0)
    beads = experiment.fiducials_rest
    core = tissue.rigid.get("grasp")
    off_mesh_m = FIDUCIAL_TOLERANCE_M + tissue.quality.deviation_m
    gripped = core.contains(beads) if core else on_patch(mesh, held["grasp"], beads, off_mesh_m)
    problem = retraction_problem(
        mesh, HeldNodes(fixed, held["grasp"]), np.asarray(experiment.grasp.centre), beads, gripped, off_mesh_m
    )
    return with_regions(problem, experiment.phantom.regions)


def liver_experiment(surface: Surface, motion: Motion) -> Experiment:
    """Return a retraction of the thin lobe with the end of the thick one anchored, nothing measured yet."""
    lower, upper = surface.bounds
    length = float(upper[0] - lower[0])
    anchor = Box(_point(lower), _point([lower[0] + _ANCHORED * length, *upper[1:]]))
    grasp = Box(_point([upper[0] - _GRIPPED * length, *lower[1:]]), _point(upper))
    tip = surface.vertices[surface.vertices[:, 0] > grasp.lower[0]]
    centre = _point((tip.min(axis=0) + tip.max(axis=0)) / 2)
    phantom = Phantom("surface", _point(upper - lower))
    beads = _beads(surface, anchor.upper[0], grasp.lower[0])
    held = Grasp(grasp, centre)
    return unmeasured(phantom, (anchor,), held, beads, motion.poses(centre))


def _beads(surface: Surface, begin: float, end: float) -> FloatArray:
    """Return vertices (m, 3) of the upper side between two planes, each as far from the others as it goes."""
    normals = np.zeros_like(surface.vertices)
    np.add.at(normals, surface.triangles, surface.area_vectors[:, None])
    x, z = surface.vertices[:, 0], normals[:, 2] / np.linalg.norm(normals, axis=1)
    margin = 0.1 * (end - begin)
    upper = surface.vertices[(z > 0.7) & (x > begin + margin) & (x < end - margin)]
    chosen = [0]
    while len(chosen) < _BEADS:
        apart = np.linalg.norm(upper[:, None] - upper[chosen], axis=2).min(axis=1)
        chosen.append(int(np.argmax(apart)))
    return upper[chosen]


def _point(coordinates: Sequence[float] | FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in coordinates)
    return x, y, z


def liver(seed: int = 0, subdivisions: int = 4) -> Study:
    """Return the study of one surface."""
    volume = organ_surface(seed, LENGTH_M, subdivisions).volume_m3
    truth = Truth(YOUNGS_MODULUS, POISSON_RATIO)

    def levels(way: Way, figure: Figure | None) -> tuple[Level, ...]:
        return tuple(
            Level(words, (Liver(motion, seed, way, subdivisions),), figure)
            for motion, (words, _) in LIVER_MOTIONS.items()
        )

    return Study(
        "liver",
        "Section VI: a liver",
        (
            f"A surface in the manner of a liver, grown by this project: two lobes, {1e3 * LENGTH_M:.0f} mm long, "
            f"{1e6 * volume:.0f} cm³. The end of the thick lobe is anchored, the end of the thin one gripped, "
            f"{_BEADS} beads on its upper side. The truth is that of the paper, E = 15 kPa and ν = 0.35.",
            "The paper gives neither size nor motion. Its mean error of the fiducials, below "
            f"{1e3 * LIVER_FIDUCIALS_M:.1f} mm and below 0.46 % of the way, says a way of some 200 mm; its largest "
            f"force error, {LIVER_FORCE_N:g} N and 2.2 % of the force, a force of 68 N. A pull of 20 mm and one of "
            "60 mm are shown; neither makes such a force.",
        ),
        (
            Group("the paper's method, linear tetrahedra on finer ones", levels("paper", LIVER), truth),
            Group("our element and likelihood, on a finer mesh of it", levels("ours", None), truth),
        ),
    )
