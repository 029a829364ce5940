"""Table IV: the gripper does not move as it is reported to."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment
from estimator.studies.paper_tables.block import MOTIONS, POISSON_RATIO, YOUNGS_MODULUS, block, measured
from estimator.studies.paper_tables.densities import posed_on, response_on
from estimator.studies.paper_tables.figures import TABLE_IV
from estimator.studies.paper_tables.fitting import fitted, row_of
from estimator.studies.paper_tables.grasp_error import GRADING, Way
from estimator.studies.paper_tables.paper_method import estimate_by_paper
from estimator.studies.running.case import Parametric, Row
from estimator.studies.tables.study import Group, Level, Study, Truth

# What the noise is a share of: the standard deviation of the gripper's positions along its way, or a step.
Reference = Literal["signal", "step"]


@dataclass(frozen=True)
class MotionNoise(Parametric):
    """One Pull whose steps miss their ends by a drawn error."""

    share: float
    draw: int
    way: Way = "paper"
    reference: Reference = "signal"
    grading: Grading = GRADING

    @property
    def name(self) -> str:
        """What was drawn."""
        return f"motion noise of {100 * self.share:g} % of the {self.reference}, draw {self.draw + 1}, {self.way}"

    def run(self) -> Row:
        """Retract along the true motion and estimate with the reported one."""
        motion = MOTIONS["pull"]
        reported = motion.poses()
        random = np.random.default_rng([self.draw, round(1e6 * self.share)])
        size_m = motion.step_m if self.reference == "step" else signal_deviation()
        true = [
            GripperPose(pose.position + self.share * size_m * random.normal(size=3), pose.rotation)
            for pose in reported[1:]
        ]
        planned = block([reported[0], *true])
        if self.way == "paper":
            seen = measured(planned, posed_on(planned, "low"))
            return estimate_by_paper([response_on("low", "pull")], [seen]).row()
        model = mesh_experiment(block(reported), self.grading)
        seen = measured(planned, model)
        return row_of(fitted(model, [replace(seen, position=block(reported).position)]))


def signal_deviation() -> float:
    """Return the standard deviation of the gripper's positions along the Pull, m: 5.7 mm of 20."""
    return float(np.std([pose.position[0] for pose in MOTIONS["pull"].poses()[1:]]))


def motion_noise(draws: int, grading: Grading = GRADING) -> Study:
    """Return the study with so many draws for each size of the noise."""
    truth = Truth(YOUNGS_MODULUS, POISSON_RATIO)

    def levels(way: Way, reference: Reference) -> tuple[Level, ...]:
        return tuple(
            Level(
                f"{100 * share:g} %" + (", or 20 %" if share == 0.25 else ""),
                tuple(MotionNoise(share, draw, way, reference, grading) for draw in range(draws)),
                figure,
            )
            for share, figure in TABLE_IV.items()
        )

    return Study(
        "table4",
        "Table IV: noise of the motion",
        (
            f"A Pull of 10 × 2 mm, drawn {draws} times. Every step misses its end by a normal error in each direction; "
            "the errors of the steps are independent, and the reported motion has none of them. The paper's deviation "
            "is a share of the size of the position signal: read as that signal's standard deviation, 5.7 mm, or as a "
            "step, 2 mm. Its text says 10, 20 and 50 %, its table 10, 25 and 50 %: the table's are drawn. Data and "
            "model share the low density.",
        ),
        (
            Group("the paper's method, share of the signal", levels("paper", "signal"), truth),
            Group("the paper's method, share of a step", levels("paper", "step"), truth),
            Group("our element and likelihood, share of the signal", levels("ours", "signal"), truth),
        ),
    )
