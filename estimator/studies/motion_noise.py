"""Table IV: the gripper does not move as it is reported to."""

from dataclasses import dataclass, replace

import numpy as np

from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fit.settings import Objective
from estimator.forward.meshing import mesh_experiment
from estimator.studies.block import MOTIONS, POISSON_RATIO, YOUNGS_MODULUS, block, measured
from estimator.studies.case import Parametric, Row
from estimator.studies.fitting import fitted, row_of
from estimator.studies.grasp_error import GRADING
from estimator.studies.objectives import OBJECTIVES
from estimator.studies.study import Group, Level, Study, Truth

SHARES = (0.10, 0.25, 0.50)


@dataclass(frozen=True)
class MotionNoise(Parametric):
    """One Pull whose steps miss their ends by a drawn error."""

    share: float
    draw: int
    objective: Objective
    grading: Grading = GRADING

    @property
    def name(self) -> str:
        """What was drawn."""
        return f"motion noise of {100 * self.share:g} %, draw {self.draw + 1}, {self.objective}"

    def run(self) -> Row:
        """Retract along the true motion and estimate with the reported one."""
        motion = MOTIONS["pull"]
        reported = motion.poses()
        random = np.random.default_rng([self.draw, round(1e6 * self.share)])
        true = [
            GripperPose(pose.position + self.share * motion.step_m * random.normal(size=3), pose.rotation)
            for pose in reported[1:]
        ]
        model = mesh_experiment(block(reported), self.grading)
        seen = measured(block([reported[0], *true]), model)
        found = fitted(model, [replace(seen, position=block(reported).position)], self.objective)
        return row_of(found)


def motion_noise(draws: int, grading: Grading = GRADING) -> Study:
    """Return the study with so many draws for each size of the noise."""
    truth = Truth(YOUNGS_MODULUS, POISSON_RATIO)
    groups = tuple(
        Group(
            words,
            tuple(
                Level(
                    f"{100 * share:g} %",
                    tuple(MotionNoise(share, draw, objective, grading) for draw in range(draws)),
                )
                for share in SHARES
            ),
            truth,
        )
        for objective, words in OBJECTIVES.items()
    )
    return Study(
        "table4",
        "Table IV: noise of the motion",
        (
            f"A Pull of 10 × 2 mm, drawn {draws} times. Every step misses its end by a normal error whose deviation in "
            "each direction is that share of the step; the errors of the steps are independent, and the reported "
            "motion has none of them.",
        ),
        groups,
    )
