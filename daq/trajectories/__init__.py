"""Trajectories: sequences of quasi-static steps, the standard retractions, routines beside them, and one's own."""

from daq.trajectories.trajectory import (
    GRADUAL_TANGENT_PULL,
    PULL,
    STANDARD,
    STANDARD_SPEED,
    TWIST_AND_PULL,
    Dwell,
    Kind,
    Phase,
    Retraction,
    Step,
    Trajectory,
    experiment_kind,
    lay_out,
)

__all__ = [
    "GRADUAL_TANGENT_PULL",
    "PULL",
    "STANDARD",
    "STANDARD_SPEED",
    "TWIST_AND_PULL",
    "Dwell",
    "Kind",
    "Phase",
    "Retraction",
    "Step",
    "Trajectory",
    "experiment_kind",
    "lay_out",
]
