"""Table III: the gripper holds the tissue elsewhere than the model believes."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from estimator.experiment import Experiment, Grasp
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment
from estimator.studies.paper_tables.block import (
    MOTIONS,
    POISSON_RATIO,
    SIZE_M,
    YOUNGS_MODULUS,
    block,
    grasp_at,
    measured,
)
from estimator.studies.paper_tables.densities import posed_on, response_on, seen_on
from estimator.studies.paper_tables.figures import TABLE_III
from estimator.studies.paper_tables.fitting import fitted, row_of
from estimator.studies.paper_tables.paper_method import estimate_by_paper
from estimator.studies.paper_tables.response import UnitResponse, solve_response
from estimator.studies.running.case import Parametric, Row
from estimator.studies.tables.study import Group, Level, Study, Truth

Way = Literal["paper", "ours"]
# Which of the two holds the tissue where the other does not: the model of known data, or the gripper itself.
Wrong = Literal["model", "gripper"]

# Data and model share it, so that the discretisation leaves nothing in the estimate.
GRADING = Grading(grasp_m=2e-3, anchor_m=6e-3, largest_m=15e-3, growth=2.5, layers=1)
_LEAST_HELD = 0.5


@dataclass(frozen=True)
class GraspError(Parametric):
    """One Pull with the centre of the grasp off by a drawn shift in the plane, its deviation that in each direction."""

    deviation_m: float
    draw: int
    way: Way = "paper"
    wrong: Wrong = "gripper"
    grading: Grading = GRADING

    @property
    def name(self) -> str:
        """What was drawn."""
        return f"grasp off, deviation {1e3 * self.deviation_m:g} mm, draw {self.draw + 1}, {self.wrong}, {self.way}"

    def run(self) -> Row:
        """Retract with one grasp and estimate with the other; the reported motion is that of the gripper."""
        shift = drawn_shift(self.deviation_m, self.draw)
        shifted = grasp_at(shift)
        if self.wrong == "model":
            seen = seen_on("high", "pull")
            found = estimate_by_paper([self._believing(shifted)], [seen])
            return found.row(shift_x=shift[0], shift_y=shift[1])
        true = block(MOTIONS["pull"].poses(shifted.centre), shifted)
        if self.way == "paper":
            seen = measured(true, posed_on(true, "low"))
            return estimate_by_paper([response_on("low", "pull")], [seen]).row(
                shift_x=shift[0], shift_y=shift[1]
            )
        stated = block(MOTIONS["pull"].poses())
        seen = measured(true, mesh_experiment(true, self.grading))
        believed: Experiment = replace(seen, grasp=stated.grasp, position=stated.position)
        found_ours = fitted(mesh_experiment(stated, self.grading), [believed])
        return row_of(found_ours, shift_x=shift[0], shift_y=shift[1])

    def _believing(self, grasp: Grasp) -> UnitResponse:
        planned = block(MOTIONS["pull"].poses(grasp.centre), grasp)
        return solve_response(posed_on(planned, "low"), planned)


def drawn_shift(deviation_m: float, draw: int) -> tuple[float, float]:
    """Return a normal shift, m, in the plane, with which at least half of the grasp still holds tissue."""
    random = np.random.default_rng([draw, round(1e6 * deviation_m)])
    while True:
        x, y = (float(value) for value in random.normal(0.0, deviation_m, 2))
        if _held_share(grasp_at((x, y))) >= _LEAST_HELD and x > -SIZE_M[0] / 2:
            return x, y


def _held_share(grasp: Grasp) -> float:
    """Return which share of a grasp, seen from above, lies on the block."""
    half = np.array(SIZE_M[:2]) / 2
    corners = np.array([grasp.box.lower[:2], grasp.box.upper[:2]])
    return float(np.prod(np.ptp(np.clip(corners, -half, half), axis=0) / np.ptp(corners, axis=0)))


def grasp_error(draws: int, grading: Grading = GRADING) -> Study:
    """Return the study with so many draws for each deviation."""
    truth = Truth(YOUNGS_MODULUS, POISSON_RATIO)

    def levels(way: Way, wrong: Wrong) -> tuple[Level, ...]:
        return tuple(
            Level(
                f"{1e3 * deviation:g} mm",
                tuple(GraspError(deviation, draw, way, wrong, grading) for draw in range(draws)),
                figure,
            )
            for deviation, figure in TABLE_III.items()
        )

    return Study(
        "table3",
        "Table III: error of the grasp",
        (
            "A Pull of 10 × 2 mm without noise. The centre of the grasp is normal in x and in y with that deviation, "
            f"in {draws} draws of which at least half of the grasp holds tissue. Whether the gripper is drawn or the "
            "model's belief of it is not given; both are shown, and both move as reported. Where the gripper is drawn, "
            "data and model share the low density.",
        ),
        (
            Group("the paper's method, the gripper is elsewhere", levels("paper", "gripper"), truth),
            Group("the paper's method, the model believes it elsewhere", levels("paper", "model"), truth),
            Group("our element and likelihood, the gripper is elsewhere", levels("ours", "gripper"), truth),
        ),
    )
