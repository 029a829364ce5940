"""The experiment folder ``retraction-experiment/2``: its types, reader, writer and checks."""

from estimator.experiment.holds import Box, Grasp, PaintedPatch, Prescribed, Roller
from estimator.experiment.model import (
    PHASES,
    TRAJECTORY_KINDS,
    Environment,
    Experiment,
    Phantom,
    SensorNoise,
    TissueRegion,
)
from estimator.experiment.mounting import check_same_mounting
from estimator.experiment.reading import read_case, read_experiment, read_mounted_phantom
from estimator.experiment.validation import check_experiment
from estimator.experiment.writing import replace_experiment, write_experiment

__all__ = [
    "PHASES",
    "TRAJECTORY_KINDS",
    "Box",
    "Environment",
    "Experiment",
    "Grasp",
    "PaintedPatch",
    "Phantom",
    "Prescribed",
    "Roller",
    "SensorNoise",
    "TissueRegion",
    "check_experiment",
    "check_same_mounting",
    "read_case",
    "read_experiment",
    "read_mounted_phantom",
    "replace_experiment",
    "write_experiment",
]
