"""Section VI: a surface in the manner of a liver."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Box, Experiment, Grasp, Phantom
from estimator.fit.settings import Objective
from estimator.forward.meshing import FINE_GRADING, surface_problem
from estimator.geometry.organ import organ_surface
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.studies.paper_tables.block import MOTIONS, measured, unmeasured
from estimator.studies.running.case import Parametric, Row
from estimator.studies.paper_tables.fitting import fitted, row_of
from estimator.studies.paper_tables.objectives import OBJECTIVES
from estimator.studies.tables.study import Group, Level, Study, Truth
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

YOUNGS_MODULUS = 6e3
POISSON_RATIO = 0.45
# Shares of the length along x that the anchor and the grasp hold, at the thick end and at the thin one.
_ANCHORED, _GRIPPED = 0.2, 0.12
_BEADS = 16


@dataclass(frozen=True)
class Liver(Parametric):
    """One estimate from one motion of one surface."""

    motion: str
    seed: int
    objective: Objective
    subdivisions: int = 4

    @property
    def name(self) -> str:
        """What is retracted, and how."""
        return f"liver {self.seed}, {self.motion.replace('_', ' ')}, {self.objective}"

    def run(self) -> Row:
        """Retract on a finer mesh and estimate on the usual one."""
        surface = organ_surface(self.seed, subdivisions=self.subdivisions)
        planned = liver_experiment(surface, self.motion)
        truth = Material(NeoHookean(), YOUNGS_MODULUS, POISSON_RATIO)
        seen = measured(planned, surface_problem(planned, surface, FINE_GRADING), truth)
        model = surface_problem(planned, surface)
        found = fitted(model, [seen], self.objective)
        return row_of(found, remark=f"{len(model.body.mesh.cells)} {model.body.mesh.kind}")


def liver_experiment(surface: Surface, motion: str) -> Experiment:
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
    return unmeasured(phantom, (anchor,), held, beads, MOTIONS[motion].poses(centre))


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
    groups = tuple(
        Group(
            words,
            tuple(
                Level(motion.replace("_", " "), (Liver(motion, seed, objective, subdivisions),))
                for motion in MOTIONS
            ),
            Truth(YOUNGS_MODULUS, POISSON_RATIO),
        )
        for objective, words in OBJECTIVES.items()
    )
    return Study(
        "liver",
        "Section VI: a liver",
        (
            "A surface in the manner of a liver, made by this project, 0.2 m long; the end of the thick lobe is "
            "anchored, the end of the thin one gripped. Data without noise from a finer mesh of quadratic "
            "tetrahedra than the model's.",
        ),
        groups,
    )
