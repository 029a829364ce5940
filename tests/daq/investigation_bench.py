"""An investigation without mechanics: a laboratory that writes made-up experiments, and an examiner who knows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast

from synthetic_diagnoses import small_experiment

from daq.investigation.choosing import Proposal
from daq.investigation.journal import Dropped, Journal
from daq.investigation.loop import Answer, Investigation, Outcome, Rules
from daq.investigation.manoeuvre import KINDS, Kind, Manoeuvre
from daq.progress import Progress, silent
from daq.rig import Rig
from daq.virtual_rig.layout import Addresses, rig_description
from estimator.diagnosis.result import Diagnosis
from estimator.diagnosis.search.baseline import Preparation
from estimator.diagnosis.search.comparison import Comparison
from estimator.experiment import Experiment, write_experiment
from estimator.optimal_design.examination import Examination

RIG: Rig = rig_description(Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2")), Path("stereo.toml"))


class BenchLaboratory:
    """Writes an experiment for every manoeuvre; ``fails`` raises in the place of one."""

    kinds: Sequence[Kind] = KINDS

    def __init__(self, folder: Path, rig: Rig = RIG) -> None:
        self.rig = rig
        self.folder = folder
        self.done: list[Manoeuvre] = []
        self.fails: dict[int, BaseException] = {}

    def planned(self, manoeuvre: Manoeuvre, like: Experiment) -> Experiment:
        return like

    def carry_out(self, manoeuvre: Manoeuvre, order: int, progress: Progress) -> Path:
        self.done.append(manoeuvre)
        if order in self.fails:
            raise self.fails.pop(order)
        path = self.folder / f"{order:02d}_{manoeuvre.name}"
        write_experiment(_tiny(order), path)
        return path


def _tiny(order: int) -> Experiment:
    """Three rows and one bead: files are read in a moment."""
    whole = small_experiment(order=order)
    rows = slice(0, 3)
    return replace(
        whole,
        phantom_id="bench",
        fiducials_rest=whole.fiducials_rest[:1],
        time=whole.time[rows],
        phase=whole.phase[rows],
        step=whole.step[rows],
        position=whole.position[rows],
        quaternion_wxyz=whole.quaternion_wxyz[rows],
        wrench=whole.wrench[rows],
        fiducials=whole.fiducials[rows, :1],
    )


@dataclass
class ScriptedExaminer:
    """Says after each experiment what the script says of so many, and ranks by what each manoeuvre is worth."""

    sure_after: int = 3
    promising_after: int = 2
    worth: Callable[[Manoeuvre], float] = lambda one: 0.3
    asked_in_full: list[bool] = field(default_factory=list)

    def screen(self, strained: Sequence[Experiment], unstrained: Sequence[Experiment]) -> Examination:
        count = len(strained) + len(unstrained)
        self.asked_in_full.append(False)
        leading = 0.99 if count >= self.sure_after else 0.92 if count >= self.promising_after else 0.4
        probability = {"gripper_slip": leading, "none": 1.0 - leading}
        return Examination(cast(Preparation, None), cast(Comparison, None), (), probability)

    def diagnose(self, screened: Examination) -> Examination:
        self.asked_in_full.append(True)
        return replace(screened, diagnosis=cast(Diagnosis, object()))

    def rank(
        self, examination: Examination, chosen_from: Sequence[Manoeuvre], journal: Journal
    ) -> list[Proposal]:
        found = [Proposal(one, self.worth(one), "for the test", "") for one in chosen_from]
        return sorted(found, key=lambda one: -one.nats_per_minute)


class ScriptedOperator:
    """Answers what a function of the proposal says, and remembers what it was asked and told."""

    def __init__(self, says: Callable[[Proposal], Answer] = lambda _: "do it") -> None:
        self.says = says
        self.proposals: list[Proposal] = []
        self.heard: list[Dropped] = []

    def told(self, dropped: Dropped) -> None:
        self.heard.append(dropped)

    def asked(self, proposal: Proposal, journal: Journal) -> Answer:
        self.proposals.append(proposal)
        return self.says(proposal)


def investigate(
    laboratory: BenchLaboratory,
    operator: ScriptedOperator | None = None,
    rules: Rules | None = None,
    examiner: ScriptedExaminer | None = None,
) -> Outcome:
    """Investigate in the laboratory's folder."""
    return Investigation(
        laboratory,
        operator or ScriptedOperator(),
        rules or Rules(),
        laboratory.folder,
        examiner or ScriptedExaminer(),
        silent,
    ).run()
