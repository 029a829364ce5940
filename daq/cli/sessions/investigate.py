"""``retract investigate``: the rig finds out by itself which cause parts model and measurement."""

import argparse
import sys
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from daq.acquisition.client import Acquisition
from daq.cli import diagnosis_documents as documents
from daq.cli.rigs import VIRTUAL, add_rig, opened_rig
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.errors import SessionError
from daq.investigation.choosing import Proposal
from daq.investigation.examiner import DiagnosingExaminer
from daq.investigation.journal import Dropped, Journal
from daq.investigation.laboratory import RigLaboratory
from daq.investigation.loop import JOURNAL_FILE, Answer, Investigation, Outcome, Rules
from daq.investigation.report import ending_sentence, likeliest, outcome_as_json, write_report
from daq.investigation.safety import Bounds
from daq.versions import package_versions
from estimator.diagnosis.conclusions.as_json import as_json
from estimator.errors import InputError
from estimator.report.diagnosis.findings import summary_text
from estimator.report.diagnosis.writing import write_report as write_diagnosis
from estimator.workers import worker_pool

PAGE_FILE = "investigation.html"
_MINUTE_S = 60.0

_EXAMPLES = """  retract investigate lab.toml --output investigations/P07
  retract investigate lab.toml --output investigations/P07 --budget 5 --stretch 15
  retract investigate virtual --yes --output investigations/virtual
  retract investigate lab.toml --output investigations/P07 --release   goes on after the robot was held

It begins with a short pull. After every manoeuvre it examines what was measured, and proposes the one that is expected
to tell most in a minute, of those whose foreseen loads stay within the limits. Nothing moves before you agree; what you
refuse is not proposed again; what the rig refuses before anything moves is dropped, and the next best is proposed. It
ends when one answer has 95 %, when nothing more can be learnt, or when the minutes are spent. Called again with the
same folder, it goes on."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    summary = "let the rig find out which cause parts model and measurement"
    parser = add_verb(verbs, "investigate", summary, _EXAMPLES, run)
    add_rig(parser)
    parser.add_argument(
        "--output",
        type=Path,
        metavar="DIR",
        help="folder; one that is there goes on (default: investigations/DATE_ID)",
    )
    parser.add_argument(
        "--budget",
        type=float,
        default=10.0,
        metavar="MIN",
        help="minutes of rig and person (default: %(default)s)",
    )
    parser.add_argument(
        "--sure",
        type=float,
        default=95.0,
        metavar="PERCENT",
        help="of one answer, ends it (default: %(default)s)",
    )
    parser.add_argument(
        "--stretch",
        type=float,
        default=25.0,
        metavar="PERCENT",
        help="of the tissue at most (default: %(default)s)",
    )
    parser.add_argument(
        "--stiffest",
        type=float,
        default=1e5,
        metavar="PA",
        help="Young's modulus that the tissue may have, for the first pull (default: %(default)g)",
    )
    parser.add_argument(
        "--yes", action="store_true", help=f'agree to every manoeuvre unasked; for "{VIRTUAL}" alone'
    )
    parser.add_argument("--operator", default="", help="who records")
    parser.add_argument(
        "--release",
        action="store_true",
        help="allow a robot that was held to move again; look at the cell first",
    )


def run(options: argparse.Namespace) -> Result:
    """Investigate, and tell what was found."""
    rules = _rules(options)
    if options.yes and options.rig != VIRTUAL:
        raise InputError(
            f'--yes: nobody would be asked before a real robot moves; it is for "{VIRTUAL}", leave it out'
        )
    if not options.yes and not sys.stdin.isatty():
        raise InputError(
            "retract investigate asks before anything moves, and standard input is no terminal; run it in one"
        )
    with opened_rig(options.rig) as rig, Acquisition(rig) as acquisition, progress() as tell:
        if options.release:
            acquisition.release()
        day = f"{datetime.now().astimezone():%Y-%m-%d_%H%M%S}"
        folder = options.output or Path("investigations") / f"{day}_{rig.specimen.phantom_id}"
        laboratory = RigLaboratory(rig, acquisition.record, folder, options.operator)
        operator = AtTerminal(input, ask=not options.yes, say=_say)
        try:
            with worker_pool() as executor:
                examiner = DiagnosingExaminer(laboratory, rules.bounds, executor, tell)
                outcome = Investigation(laboratory, operator, rules, folder, examiner, tell).run()
        except KeyboardInterrupt as interrupt:
            raise type(interrupt)(
                f"interrupted: the robot is held, what is done is kept in {folder}; "
                f"retract investigate {options.rig} --output {folder} --release goes on"
            ) from None
    return _result(outcome, folder, options.rig)


class AtTerminal:
    """An operator at a terminal.

    Parameters
    ----------
    read : returns a line that the operator has typed
    ask : whether to ask at all
    say : writes a line
    """

    def __init__(self, read: Callable[[str], str], *, ask: bool, say: Callable[[str], None]) -> None:
        self._read = read
        self._ask = ask
        self._say = say

    def told(self, dropped: Dropped) -> None:
        """Say what is dropped, and why."""
        self._say(f"Dropped: {dropped.words}")

    def asked(self, proposal: Proposal, journal: Journal) -> Answer:
        """Show what is proposed and why, what it asks for and risks, and return what the operator says."""
        if journal.entries:
            self._say(f"So far: {likeliest(journal.entries[-1].probabilities)}")
        self._say(f"Next: {proposal.manoeuvre.words} ({proposal.manoeuvre.duration_s:.0f} s)")
        self._say(f"  why: {proposal.reason}")
        for wish in proposal.manoeuvre.asks:
            self._say(f"  please: {wish}")
        if proposal.damages:
            self._say(f"  risk: {proposal.damages}")
        if not self._ask:
            return "do it"
        done = "done, go" if proposal.manoeuvre.asks else "go"
        while True:
            try:
                said = self._read(f"  {done} (y), not this one (n), stop here (s)? ").strip().lower()
            except EOFError:
                return "stop"
            if said in ("y", "yes"):
                return "do it"
            if said in ("n", "no"):
                return "not this one"
            if said in ("s", "stop"):
                return "stop"


def _rules(options: argparse.Namespace) -> Rules:
    try:
        bounds = Bounds(stretch=options.stretch / 100.0, stiffest_pa=options.stiffest)
        return Rules(budget_s=options.budget * _MINUTE_S, sure=options.sure / 100.0, bounds=bounds)
    except ValueError as error:
        raise InputError(f"--budget, --sure, --stretch or --stiffest: {error}") from error


def _result(outcome: Outcome, folder: Path, rig: str) -> Result:
    page = folder / PAGE_FILE
    provenance = {"rig": rig, "folder": str(folder), **package_versions()}
    write_report(outcome, page, provenance)
    lines = [ending_sentence(outcome)]
    examination = outcome.examination
    if examination is not None and examination.diagnosis is not None:
        found = examination.diagnosis
        write_diagnosis(
            found,
            folder / documents.PAGE_FILE,
            title=f"Diagnosis of {outcome.journal.phantom_id}",
            provenance=provenance,
        )
        (folder / documents.DATA_FILE).write_text(documents.data_text(as_json(found)), encoding="utf-8")
        lines.append(summary_text(found))
    lines.append(f"Report: {page}")
    if outcome.ending == "robot held":
        raise SessionError(
            f"the robot is held: {lines[0]} Look at the cell; with --release and --output {folder} it goes on"
        )
    data = {
        **outcome_as_json(outcome),
        "journal": str(folder / JOURNAL_FILE),
        "report": str(page),
    }
    return Result("\n".join(lines), data)


def _say(line: str) -> None:
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()
