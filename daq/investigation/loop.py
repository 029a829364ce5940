"""The investigation: propose, ask, carry out, examine, until one answer is sure or nothing more can be told."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Protocol

from daq.errors import MotionLimitError, SoftwareStopError
from daq.investigation.choosing import Proposal, candidates, openings
from daq.investigation.examiner import Examiner
from daq.investigation.journal import Dropped, Entry, Journal, read_journal, write_journal
from daq.investigation.laboratory import Laboratory
from daq.investigation.manoeuvre import Manoeuvre
from daq.investigation.offered import OFFERED, OPENING
from daq.investigation.safety import Bounds
from daq.progress import Progress
from estimator.experiment import read_experiment
from estimator.optimal_design.examination import Examination
from robot_drivers.errors import MotionRefusedError

JOURNAL_FILE = "investigation.json"

Answer = Literal["do it", "not this one", "stop"]
Ending = Literal[
    "one answer is sure",
    "nothing more to learn",
    "budget spent",
    "everything refused",
    "stopped by the operator",
    "robot held",
]


class Operator(Protocol):
    """Who decides whether anything moves."""

    def told(self, dropped: Dropped) -> None:
        """Hear that a manoeuvre that was agreed to cannot be done; nothing has moved."""

    def asked(self, proposal: Proposal, journal: Journal) -> Answer:
        """Return whether a proposal is carried out; what it asks of a person has been done then."""


@dataclass(frozen=True, slots=True)
class Rules:
    """When an investigation ends, and what it may do.

    Attributes
    ----------
    budget_s : of rig and person
    sure : probability of one answer that ends it
    promising : probability after screening from which on a diagnosis in full decides
    least_nats : an expectation of less is nothing to be learnt
    bounds : of what may be done
    opening, offered : manoeuvres to choose from, first and then
    """

    budget_s: float = 600.0
    sure: float = 0.95
    promising: float = 0.9
    least_nats: float = 0.05
    bounds: Bounds = field(default_factory=Bounds)
    opening: tuple[Manoeuvre, ...] = OPENING
    offered: tuple[Manoeuvre, ...] = OFFERED

    def __post_init__(self) -> None:
        if not (self.budget_s > 0 and 0 < self.sure < 1 and 0 < self.promising < 1 and self.least_nats >= 0):
            raise ValueError(
                "budget_s must be positive, sure and promising probabilities, least_nats not negative"
            )


@dataclass(frozen=True, eq=False)
class Outcome:
    """How an investigation ended: why, what was done, and the last examination; None where nothing was measured."""

    ending: Ending
    journal: Journal
    examination: Examination | None

    @property
    def probabilities(self) -> Mapping[str, float]:
        """Of every answer; empty where nothing was measured."""
        return {} if self.examination is None else self.examination.probability


class Investigation:
    """An investigation in a folder; what was begun there goes on.

    Parameters
    ----------
    laboratory, operator : who measures, and who is asked
    rules : Rules
    folder : of the journal
    examiner : who judges what was measured and what could be done next
    progress : told what is being done

    Raises
    ------
    SessionError
        The folder's journal cannot be used.
    """

    def __init__(
        self,
        laboratory: Laboratory,
        operator: Operator,
        rules: Rules,
        folder: Path,
        examiner: Examiner,
        progress: Progress,
    ) -> None:
        self._laboratory = laboratory
        self._operator = operator
        self._rules = rules
        self._file = folder / JOURNAL_FILE
        self._examiner = examiner
        self._progress = progress
        self.journal = read_journal(self._file, laboratory.rig.specimen.phantom_id)

    def run(self) -> Outcome:
        """Go on until there is an end; every manoeuvre is in the journal before the next one is proposed.

        Raises
        ------
        DaqError, DeviceError, EstimatorError
            A manoeuvre or an examination has failed; the journal holds what was done before.
        KeyboardInterrupt
            The robot is held; the same.
        """
        examination = self._screened() if self.journal.entries else None
        while True:
            if examination is not None:
                examination = self._decided(examination)
                if self._is_sure(examination):
                    return Outcome("one answer is sure", self.journal, examination)
            proposals = self._proposals(examination)
            if not proposals and examination is not None and examination.diagnosis is None:
                examination = self._diagnosed(examination)
                continue  # what screening leaves open a diagnosis in full may see otherwise
            ending = self._do_one(proposals)
            if ending is not None:
                held = ending == "robot held"
                last = examination if held or examination is None else self._in_full(examination)
                return Outcome(ending, self.journal, last)
            examination = self._screened()

    def _proposals(self, examination: Examination | None) -> list[Proposal]:
        rules = self._rules
        if examination is None:
            return openings(self._laboratory, rules.opening, self.journal, rules.bounds)
        left = candidates(
            self._laboratory, rules.offered, self.journal, rules.bounds, rules.budget_s - self.journal.seconds
        )
        found = self._examiner.rank(examination, left, self.journal)
        return [one for one in found if one.nats >= rules.least_nats]

    def _do_one(self, proposals: Sequence[Proposal]) -> Ending | None:
        """Carry out the first proposal that the operator wants and the rig does not refuse, or return why none."""
        for one in proposals:
            if not self.journal.is_open(one.manoeuvre):
                continue  # a person took the tissue out of the jaws for one before
            answer = self._operator.asked(one, self.journal)
            if answer == "stop":
                return "stopped by the operator"
            if answer == "not this one":
                self._keep(self.journal.refusing(one.manoeuvre))
                continue
            try:
                self._carry_out(one)
            except (MotionLimitError, MotionRefusedError) as refusal:
                dropped = Dropped(one.manoeuvre, str(refusal))
                self._keep(self.journal.dropping(dropped))
                self._operator.told(dropped)
            except SoftwareStopError as error:
                self._progress(str(error), 0, 1)
                self._keep(self.journal.refusing(one.manoeuvre))
                return "robot held"
            else:
                return None
        if proposals:
            return "everything refused"
        shortest = min((one.duration_s for one in self._rules.offered), default=0.0)
        spent = self.journal.seconds + shortest > self._rules.budget_s
        return "budget spent" if spent else "nothing more to learn"

    def _carry_out(self, chosen: Proposal) -> None:
        number = len(self.journal.entries) + 1
        self._progress(f"{number}. {chosen.manoeuvre.words}: {chosen.reason}", 0, 1)
        experiment = self._laboratory.carry_out(chosen.manoeuvre, number, self._progress)
        seconds = chosen.manoeuvre.duration_s
        entry = Entry(chosen.manoeuvre, str(experiment), seconds, chosen.nats, chosen.reason)
        self._keep(self.journal.with_entry(entry))

    def _screened(self) -> Examination:
        measured = [(one.manoeuvre, read_experiment(Path(one.experiment))) for one in self.journal.entries]
        found = self._examiner.screen(
            [experiment for manoeuvre, experiment in measured if manoeuvre.strains],
            [experiment for manoeuvre, experiment in measured if not manoeuvre.strains],
        )
        self._keep(self.journal.with_last(found.probability, in_full=False))
        return found

    def _diagnosed(self, screened: Examination) -> Examination:
        found = self._examiner.diagnose(screened)
        self._keep(self.journal.with_last(found.probability, in_full=True))
        return found

    def _decided(self, examination: Examination) -> Examination:
        """Return a diagnosis in full where screening promises an end, else what there is."""
        promises = examination.probability[examination.leading] >= self._rules.promising
        return self._in_full(examination) if promises else examination

    def _in_full(self, examination: Examination) -> Examination:
        return self._diagnosed(examination) if examination.diagnosis is None else examination

    def _is_sure(self, examination: Examination) -> bool:
        surely = examination.probability[examination.leading] >= self._rules.sure
        return surely and examination.diagnosis is not None

    def _keep(self, journal: Journal) -> None:
        self.journal = journal
        write_journal(journal, self._file)
