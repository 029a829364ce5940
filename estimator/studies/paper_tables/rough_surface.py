"""Table II: a phantom with a rough top, which the model takes for a smooth block."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Box, Experiment
from estimator.fit.settings import Objective
from estimator.forward.meshing import mesh_experiment, surface_problem
from estimator.geometry.rough import raised_block, rough_block
from estimator.studies.paper_tables import paper
from estimator.studies.paper_tables.block import MOTIONS, POISSON_RATIO, SIZE_M, YOUNGS_MODULUS, block, measured
from estimator.studies.running.case import Parametric, Row
from estimator.studies.paper_tables.fitting import fitted, row_of
from estimator.studies.tables.study import UNKNOWN, Group, Level, Study, Truth
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]
Relief = Literal["raised", "about_mean"]
Model = Literal["smooth", "rough"]

HEIGHTS = (0.02, 0.04, 0.08)
# Squares along the edges: every bead stands on one of their corners.
CELLS = (60, 60, 6)


@dataclass(frozen=True)
class RoughSurface(Parametric):
    """One Pull of a rough block, estimated with a smooth one or with its true surface."""

    relief: Relief
    height: float
    seed: int
    model: Model
    objective: Objective = "paper"
    cells: tuple[int, int, int] = CELLS

    @property
    def name(self) -> str:
        """What was drawn."""
        return f"relief of {100 * self.height:g} %, {self.relief}, seed {self.seed}, {self.model} model"

    def run(self) -> Row:
        """Retract the rough block and estimate."""
        surface = rough_surface_of(self.relief, self.height, self.seed, self.cells)
        smooth = block(MOTIONS["pull"].poses())
        rough = on_surface(smooth, surface)
        true = surface_problem(rough, surface)
        seen = measured(rough, true)
        if self.model == "smooth":
            # What is compared is how far the beads have moved: a smooth block has them elsewhere.
            moved = seen.fiducials - rough.fiducials_rest + smooth.fiducials_rest
            found = fitted(
                mesh_experiment(smooth),
                [replace(smooth, wrench=seen.wrench, fiducials=moved)],
                self.objective,
            )
        else:
            found = fitted(true, [seen], self.objective)
        volume = float(np.prod(SIZE_M))
        return row_of(found, remark=f"mean thickness {100 * (surface.volume_m3 / volume - 1):+.0f} %")


def rough_surface_of(relief: Relief, height: float, seed: int, cells: tuple[int, int, int]) -> Surface:
    """Return the rough block: its relief as a share of the block's edge, standing on it, or of its thickness."""
    if relief == "raised":
        return raised_block(SIZE_M, height * SIZE_M[0], seed, cells)
    return rough_block(SIZE_M, height, seed, cells)


def on_surface(experiment: Experiment, surface: Surface) -> Experiment:
    """Return the experiment with its beads on the surface's top, and its grasp through all of its thickness."""
    top = float(surface.bounds[1, 2])
    lower, upper = experiment.grasp.box.lower, experiment.grasp.box.upper
    grasp = replace(experiment.grasp, box=Box(lower, (upper[0], upper[1], top)))
    anchors = tuple(Box(a.lower, (a.upper[0], a.upper[1], top)) for a in experiment.anchors)
    beads = np.array([_on_top(surface, bead) for bead in experiment.fiducials_rest])
    rows = np.tile(beads, (len(experiment.time), 1, 1))
    return replace(experiment, grasp=grasp, anchors=anchors, fiducials_rest=beads, fiducials=rows)


def rough_surface(seeds: Sequence[int], cells: tuple[int, int, int] = CELLS) -> Study:
    """Return the study with these reliefs for each height."""
    truth = Truth(YOUNGS_MODULUS, POISSON_RATIO)

    def levels(relief: Relief, model: Model, drawn: Sequence[int], of: str) -> tuple[Level, ...]:
        figures = paper.ROUGH_SURFACE if (relief, model) == ("raised", "smooth") else {}
        return tuple(
            Level(
                f"{100 * height:g} % of the {of}",
                tuple(RoughSurface(relief, height, seed, model, cells=cells) for seed in drawn),
                figures.get(height, UNKNOWN),
            )
            for height in HEIGHTS
        )

    return Study(
        "table2",
        "Table II: rough surfaces",
        (
            "A Pull of 10 × 2 mm without noise of a block with a ridged multifractal on its top. The paper's changes "
            "of E are those of the mean thickness where the relief is a share of the block's edge and stands on the "
            "block: so it is read here. A relief about the mean, of a share of the thickness, does little.",
            "With the true surface as model, what is left is none of the surface's: data and model share the mesh.",
        ),
        (
            Group("relief on the block, smooth model", levels("raised", "smooth", seeds, "edge"), truth),
            Group("relief on the block, true surface", levels("raised", "rough", seeds[:1], "edge"), truth),
            Group(
                "relief about the mean, smooth model",
                levels("about_mean", "smooth", seeds, "thickness"),
                truth,
            ),
        ),
    )


def _on_top(surface: Surface, bead: FloatArray) -> FloatArray:
    """Return the highest vertex over a bead."""
    over = np.linalg.norm(surface.vertices[:, :2] - bead[:2], axis=1)
    near = surface.vertices[over < over.min() + 1e-9]
    return np.asarray(near[np.argmax(near[:, 2])])
