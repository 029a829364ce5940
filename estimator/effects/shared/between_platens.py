"""Whether a phantom is pressed between two plates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.experiment import Experiment
from estimator.fem.boundary.platens import platens_of
from estimator.fem.boundary.problem import RetractionProblem


def is_pressed(problem: RetractionProblem, experiments: Sequence[Experiment]) -> bool:
    """Tell whether the body is held by two parallel faces alone, and the gripper presses more than it draws.

    A plate that draws at the tissue is glued to it.
    """
    platens = platens_of(problem)
    if platens is None:
        return False
    points = problem.body.mesh.points[:, platens.axis]
    outward = np.sign(points[platens.moving].mean() - points[platens.standing].mean())
    way = [one.position[:, platens.axis] - one.grasp.centre[platens.axis] for one in experiments]
    farther = outward * np.concatenate(way)
    return bool(-farther.min() > farther.max())
