"""The block on the paper's meshes: linear tetrahedra of its low and its high density, flat or with a relief on top."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment, Grasp
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.morph import with_points
from estimator.studies.paper_tables.block import MOTIONS, SIZE_M, block, measured
from estimator.studies.paper_tables.response import UnitResponse, solve_response
from estimator.studies.paper_tables.tetrahedra import block_of_tetrahedra

FloatArray = NDArray[np.float64]

Density = Literal["low", "high"]

# Cells of uniform meshes of about as many nodes as the paper's: 972 and 3125 for 991 and 3122, with six linear
# tetrahedra each: 3468 and 13 824 for 3595 and 13 473.
CELLS: dict[str, tuple[int, int, int]] = {"low": (17, 17, 2), "high": (24, 24, 4)}


def posed_on(experiment: Experiment, density: Density) -> RetractionProblem:
    """Pose a retraction of the block on linear tetrahedra."""
    return block_of_tetrahedra(experiment, CELLS[density])


def raised(
    experiment: Experiment, density: Density, relief: Callable[[FloatArray], FloatArray]
) -> RetractionProblem:
    """Pose it with its top raised by ``relief`` of places (n, 2) in the plane, m; beads go up with the top."""
    flat = posed_on(experiment, density)
    points = flat.body.mesh.points

    def lifted(at: FloatArray) -> FloatArray:
        up = (at[:, 2] / SIZE_M[2] + 0.5) * relief(at[:, :2])
        return np.column_stack([at[:, :2], at[:, 2] + up])

    return replace(with_points(flat, lifted(points)), fiducials_rest=lifted(flat.fiducials_rest))


@cache
def seen_on(density: Density, motion: str) -> Experiment:
    """Return what perfect sensors read of a motion of the true block; several cases of a process estimate from it."""
    planned = block(MOTIONS[motion].poses())
    return measured(planned, posed_on(planned, density))


@cache
def response_on(density: Density, motion: str, grasp: Grasp | None = None) -> UnitResponse:
    """Return the smooth block's answer to a motion, for every E and ν."""
    planned = block(MOTIONS[motion].poses(), grasp)
    return solve_response(posed_on(planned, density), planned)
