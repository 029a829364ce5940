"""Who judges what was measured, and what could be done next: the diagnosis, by worker processes."""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Protocol

from daq.investigation.choosing import Proposal, ranked
from daq.investigation.journal import Journal
from daq.investigation.laboratory import Laboratory
from daq.investigation.manoeuvre import Manoeuvre
from daq.investigation.safety import Bounds
from daq.progress import Progress
from estimator.experiment import Experiment
from estimator.optimal_design.examination import Examination, examine


class Examiner(Protocol):
    """Judges experiments and manoeuvres."""

    def examine(
        self, strained: Sequence[Experiment], unstrained: Sequence[Experiment], in_full: bool
    ) -> Examination:
        """Return what experiments say: in which tissue was strained, and others; screened, or in full."""

    def rank(
        self, examination: Examination, chosen_from: Sequence[Manoeuvre], journal: Journal
    ) -> list[Proposal]:
        """Return what is safe of some manoeuvres, the one that is expected to tell most in a minute first."""


@dataclass(frozen=True)
class DiagnosingExaminer:
    """Judges by the diagnosis.

    Attributes
    ----------
    laboratory, bounds : where manoeuvres are carried out, and how far they may go
    executor : workers
    progress : told what is being computed
    """

    laboratory: Laboratory
    bounds: Bounds
    executor: Executor
    progress: Progress

    def examine(
        self, strained: Sequence[Experiment], unstrained: Sequence[Experiment], in_full: bool
    ) -> Examination:
        """Screen, or diagnose in full.

        Raises
        ------
        InputError, FitError, SolverError
            As :func:`estimator.diagnosis.diagnose.diagnose`.
        """
        return examine(strained, unstrained, in_full, self.executor, self.progress)

    def rank(
        self, examination: Examination, chosen_from: Sequence[Manoeuvre], journal: Journal
    ) -> list[Proposal]:
        """Rehearse every manoeuvre under the answers that are left."""
        return ranked(self.laboratory, examination, chosen_from, journal, self.bounds, self.executor)
