"""What stands before any hypothesis: experiments of one phantom in one mounting, their mesh, what pulls at the grip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem


@dataclass(frozen=True, eq=False)
class Setup:
    """The mechanical problem of a case.

    Attributes
    ----------
    experiments : in the order in which they were done
    problem : the baseline's boundary value problem
    loads : of each experiment, what pulls at the gripper
    settings : how exactly it is solved
    """

    experiments: Sequence[Experiment]
    problem: RetractionProblem
    loads: Sequence[GripLoad]
    settings: DiagnosisSettings = field(default_factory=DiagnosisSettings, kw_only=True)
