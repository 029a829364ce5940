"""A good experiment on a block of springs, and what its checks find, for the tests of `retract check`."""

from pathlib import Path

import numpy as np
from retraction_cases import SMALL_BLOCK, from_rest, recorded, straight_pull
from scipy.spatial.transform import Rotation

from estimator.experiment import Experiment, write_experiment
from estimator.experiment_checks import Finding, findings_of
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.equilibrium.observation import Observation

STIFFNESS = np.array([400.0, 300.0, 250.0])  # N/m, of a block of some tens of kPa


def of_springs(poses: list[GripperPose], noise: float = 1.0, seed: int = 0) -> Experiment:
    """What a block of linear springs answers, whose beads follow by their place between anchor and grasp."""
    rest = SMALL_BLOCK
    centre, half = np.array(rest.grasp.centre), rest.phantom.size_m[0] / 2
    share = (rest.fiducials_rest[:, :1] + half) / (centre[0] + half)
    seen = []
    for pose in poses:
        moved = np.asarray(pose.position) - centre
        force = np.concatenate([-STIFFNESS * moved, -0.05 * pose.rotation.as_rotvec()])
        seen.append(Observation(force, rest.fiducials_rest + share * moved, {}, {}, None, None, {}))
    return recorded(rest, poses, seen, np.random.default_rng(seed), noise=noise)


def there_and_back() -> list[GripperPose]:
    pull = straight_pull(SMALL_BLOCK, 0.008, 4)
    return from_rest(
        SMALL_BLOCK,
        [*pull, *pull[-2::-1], GripperPose(np.array(SMALL_BLOCK.grasp.centre), Rotation.identity())],
    )


def both_ways() -> list[GripperPose]:
    return from_rest(
        SMALL_BLOCK, [*straight_pull(SMALL_BLOCK, 0.006, 3), *straight_pull(SMALL_BLOCK, -0.006, 3)]
    )


GOOD = of_springs(there_and_back())


def graded(experiment: Experiment) -> dict[str, Finding]:
    """The first finding of each check, without those of which nothing is to be said."""
    found: dict[str, Finding] = {}
    for finding in findings_of(experiment):
        found.setdefault(finding.check, finding)
    return found


def written(experiment: Experiment, folder: Path) -> Path:
    write_experiment(experiment, folder)
    return folder
