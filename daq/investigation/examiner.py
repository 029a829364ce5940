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
from estimator.optimal_design.examination import Examination, examine, examine_in_full


class Examiner(Protocol):
    """Judges experiments and manoeuvres."""

    def screen(self, strained: Sequence[Experiment], unstrained: Sequence[Experiment]) -> Examination:
        """Return what experiments say at a first look: in which tissue was strained, and others."""

    def diagnose(self, screened: Examination) -> Examination:
        """Return what they say in full."""

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

    def screen(self, strained: Sequence[Experiment], unstrained: Sequence[Experiment]) -> Examination:
        """Screen the catalogue.

        Raises
        ------
        InputError, FitError, SolverError
            As :func:`estimator.diagnosis.diagnose.diagnose`.
        """
        return examine(strained, unstrained, self.executor, self.progress)

    def diagnose(self, screened: Examination) -> Examination:
        """Refit the leaders.

        Raises
        ------
        SolverError
            The baseline has no equilibrium.
        """
        return examine_in_full(screened)

    def rank(
        self, examination: Examination, chosen_from: Sequence[Manoeuvre], journal: Journal
    ) -> list[Proposal]:
        """Rehearse every manoeuvre under the answers that are left."""
        return ranked(self.laboratory, examination, chosen_from, journal, self.bounds, self.executor)
