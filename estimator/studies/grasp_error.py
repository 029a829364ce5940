"""Table III: the gripper holds the tissue elsewhere than the model believes."""

import math
from dataclasses import dataclass, replace

import numpy as np

from estimator.experiment import Grasp
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fit.settings import Objective
from estimator.forward.meshing import mesh_experiment
from estimator.studies import paper
from estimator.studies.block import MOTIONS, POISSON_RATIO, SIZE_M, YOUNGS_MODULUS, block, grasp_at, measured
from estimator.studies.case import Parametric, Row
from estimator.studies.fitting import fitted, row_of
from estimator.studies.objectives import OBJECTIVES
from estimator.studies.study import UNKNOWN, Group, Level, Study, Truth

ERRORS_M = (5e-3, 10e-3, 20e-3)
# Data and model share it, so that the discretisation leaves nothing in the estimate.
GRADING = Grading(grasp_m=2e-3, anchor_m=6e-3, largest_m=15e-3, growth=2.5, layers=1)
_LEAST_HELD = 0.5


@dataclass(frozen=True)
class GraspError(Parametric):
    """One Pull with the grasp off by a length in a drawn direction of the plane."""

    error_m: float
    draw: int
    objective: Objective
    grading: Grading = GRADING

    @property
    def name(self) -> str:
        """What was drawn."""
        return f"grasp off by {1e3 * self.error_m:g} mm, draw {self.draw + 1}, {self.objective}"

    def run(self) -> Row:
        """Retract with the true grasp and estimate with the stated one."""
        stated = block(MOTIONS["pull"].poses())
        shift = drawn_shift(self.error_m, self.draw)
        grasp = grasp_at(shift)
        true = block(MOTIONS["pull"].poses(grasp.centre), grasp)
        seen = measured(true, mesh_experiment(true, self.grading))
        believed = replace(seen, grasp=stated.grasp, position=stated.position)
        found = fitted(mesh_experiment(stated, self.grading), [believed], self.objective)
        return row_of(found, shift_x=shift[0], shift_y=shift[1])


def drawn_shift(error_m: float, draw: int) -> tuple[float, float]:
    """Return a shift, m, in a direction of the plane in which at least half of the grasp still holds tissue."""
    random = np.random.default_rng([draw, round(1e6 * error_m)])
    while True:
        angle = random.uniform(0.0, 2 * math.pi)
        shift = error_m * math.cos(angle), error_m * math.sin(angle)
        if _held_share(grasp_at(shift)) >= _LEAST_HELD:
            return shift


def _held_share(grasp: Grasp) -> float:
    """Return which share of a grasp, seen from above, lies on the block."""
    half = np.array(SIZE_M[:2]) / 2
    corners = np.array([grasp.box.lower[:2], grasp.box.upper[:2]])
    return float(np.prod(np.ptp(np.clip(corners, -half, half), axis=0) / np.ptp(corners, axis=0)))


def grasp_error(draws: int, grading: Grading = GRADING) -> Study:
    """Return the study with so many draws for each error."""
    truth = Truth(YOUNGS_MODULUS, POISSON_RATIO)
    groups = tuple(
        Group(
            words,
            tuple(
                Level(
                    f"{1e3 * error:g} mm",
                    tuple(GraspError(error, draw, objective, grading) for draw in range(draws)),
                    paper.GRASP_ERROR.get(error, UNKNOWN),
                )
                for error in ERRORS_M
            ),
            truth,
        )
        for objective, words in OBJECTIVES.items()
    )
    return Study(
        "table3",
        "Table III: error of the grasp",
        (
            "A Pull of 10 × 2 mm without noise. The gripper holds the tissue so far from where it is believed to, in "
            f"{draws} drawn directions in which at least half of the grasp still holds tissue; it moves as reported.",
        ),
        groups,
    )
