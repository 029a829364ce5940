"""What an engine answers to the motion that it was given, and its rows as sensors would have recorded them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.handover.model import Run
from estimator.handover.observations import Observations, as_recorded

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class EngineAnswer:
    """Wrench (s, 6), N and N·m, and beads (s, m, 3), m, of one experiment's load steps, and the seconds they took."""

    wrench: FloatArray
    beads: FloatArray
    seconds: float


def wrench_of(reaction: FloatArray, points: FloatArray, pose: GripperPose) -> FloatArray:
    """Return the wrench (6,) of the tissue on the gripper about its origin.

    ``reaction`` (g, 3), N, is what holds the gripped nodes where they are, at ``points`` (g, 3), m.
    """
    force = -reaction
    return np.concatenate([force.sum(axis=0), np.cross(points - pose.position, force).sum(axis=0)])


def recorded(answer: EngineAnswer, run: Run, problem: RetractionProblem) -> Observations:
    """Return an engine's rows through the sensors and cameras that were handed over."""
    rows = run.of_row
    rotation = np.array([pose.rotation.as_matrix() for pose in run.poses])
    position = np.array([pose.position for pose in run.poses])
    observations = Observations(
        run.experiment.time,
        position[rows],
        rotation[rows],
        answer.wrench[rows],
        answer.beads[rows],
        run.experiment.fiducials_rest,
        run.reported,
    )
    return as_recorded(observations, run.steps)
