"""The retractions behind a published table: a block, anchored on one face or two, and three motions of its gripper.

Block, grasp and beads are those of the paper's section IV. Only how far and how much the gripper turns is not given for
its experiments; "about 10 % elongation" is read as 10 mm of the 100 mm, the angles are this project's usual ones.
Without memory in the tissue an elastic retraction is the same in few steps as in many: the objective is a sum over
equal steps either way.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from estimator.experiment import Box, Experiment, Phantom
from estimator.experiment.model import TrajectoryKind
from estimator.fem.boundary.motion import GripperPose
from estimator.studies.paper_tables.block import Motion, grasp_at, grid_of_beads, unmeasured

Anchoring = Literal["one_side", "two_sides"]
MotionName = Literal["pull", "gradual_tangent_pull", "twist_and_pull"]
ANCHORINGS: tuple[Anchoring, ...] = get_args(Anchoring)
MOTION_NAMES: tuple[MotionName, ...] = get_args(MotionName)


@dataclass(frozen=True, slots=True)
class SetUp:
    """What the table does not say row by row.

    Attributes
    ----------
    size_m : edges of the block, m
    way_m : of the gripper along +x, m
    tangent_rad, twist_rad : how far it turns about z and about x on that way
    steps : equal ones; the gripper rests a second after each
    density : of the silicone, kg/m³
    """

    size_m: tuple[float, float, float] = (0.10, 0.10, 0.01)
    way_m: float = 0.010
    tangent_rad: float = math.radians(30.0)
    twist_rad: float = math.radians(45.0)
    steps: int = 5
    density: float = 1070.0

    def motion(self, name: MotionName) -> Motion:
        """Return a motion by its name."""
        turns = {
            "pull": ((1.0, 0.0, 0.0), 0.0),
            "gradual_tangent_pull": ((0.0, 0.0, 1.0), self.tangent_rad),
            "twist_and_pull": ((1.0, 0.0, 0.0), self.twist_rad),
        }
        axis, angle = turns[name]
        return Motion(self.steps, self.way_m / self.steps, axis, angle)


def retraction(set_up: SetUp, anchoring: Anchoring, motion: MotionName, order: int = 1) -> Experiment:
    """Return a retraction with nothing measured yet, anchored at x = −size/2, for two sides at y = +size/2 too."""
    half = np.array(set_up.size_m) / 2
    left = Box((-half[0], -half[1], -half[2]), (-half[0], half[1], half[2]))
    back = Box((-half[0], half[1], -half[2]), (half[0], half[1], half[2]))
    anchors = (left,) if anchoring == "one_side" else (left, back)
    poses: list[GripperPose] = set_up.motion(motion).poses()
    planned = unmeasured(
        Phantom("block", set_up.size_m, density=set_up.density),
        anchors,
        grasp_at((0.0, 0.0)),
        grid_of_beads(float(half[2])),
        poses,
    )
    kind: TrajectoryKind = motion
    return replace(planned, trajectory_kind=kind, order=order, name=motion)


def mounting(set_up: SetUp, anchoring: Anchoring) -> list[Experiment]:
    """Return the three retractions of one phantom in one mounting, in the paper's order."""
    return [retraction(set_up, anchoring, name, order) for order, name in enumerate(MOTION_NAMES, start=1)]
