"""The rig that diagnoses itself beside the fixed plan of three retractions, on causes that the blind maker hides."""

import argparse
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.hidden_laboratory import HiddenLaboratory
from daq.investigation.choosing import Proposal
from daq.investigation.examiner import DiagnosingExaminer
from daq.investigation.journal import Dropped, Journal
from daq.investigation.loop import Answer, Investigation, Rules
from daq.plans import Trial
from daq.progress import silent
from daq.trajectories import STANDARD
from daq.trajectories.planned import duration_s
from daq.virtual_rig.layout import LIMITS
from estimator.blind.making.effects.catalogue import FORM_SETS
from estimator.blind.making.plan import NONE, Planned, plan
from estimator.errors import EstimatorError
from estimator.experiment import read_experiment
from estimator.optimal_design.examination import examine, examine_in_full
from estimator.optimal_design.information import entropy
from estimator.workers import worker_pool

_MINUTE_S = 60.0
_HOLDS_S = (3.0, 8.0, 18.0)


class Willing:
    """An operator who agrees to everything: nothing real moves."""

    def told(self, dropped: Dropped) -> None:
        """Take note of what could not be simulated: the journal keeps it."""

    def asked(self, proposal: Proposal, journal: Journal) -> Answer:
        """Agree."""
        del proposal, journal
        return "do it"


@dataclass(frozen=True, slots=True)
class Found:
    """What one way of going about has found of a case.

    Attributes
    ----------
    answer, probability : the most probable one
    minutes : of the rig, and of the person where one was asked for something
    manoeuvres : what was done
    largest_force : true one in any row, N
    ending : why it ended
    foretold, came : information of each manoeuvre but the first, expected and as it came, nats
    seconds : of computation
    """

    answer: str
    probability: float
    minutes: float
    manoeuvres: tuple[str, ...]
    largest_force: float
    ending: str
    foretold: tuple[float, ...]
    came: tuple[float, ...]
    seconds: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what the benchmark needs to know."""
    parser.add_argument("--seed", type=int, required=True, help="of the cases")
    parser.add_argument("--cases", type=int, default=6, help="how many (default: %(default)s)")
    parser.add_argument("--first", type=int, default=1, help="number of the first (default: %(default)s)")
    parser.add_argument("--forms", choices=FORM_SETS, default="mixed", help="default: %(default)s")
    parser.add_argument("--only", nargs="*", default=(), metavar="LABEL", help="limit the causes to these")
    parser.add_argument("--budget", type=float, default=3.0, metavar="MIN", help="default: %(default)s")
    parser.add_argument("--quick", action="store_true", help="on a very coarse mesh, for trials")
    parser.add_argument(
        "--results",
        type=Path,
        default=Path("runs/investigation"),
        metavar="DIR",
        help="what is done; a later run goes on (default: %(default)s)",
    )


def lines(options: argparse.Namespace) -> Iterator[str]:
    """Give two lines for each case, and what they come to."""
    last = options.first - 1 + options.cases
    cases = [
        replace(one, wide=False)
        for one in plan(options.seed, last, tuple(options.only), form_set=options.forms)[options.first - 1 :]
    ]
    done: list[tuple[Planned, Found, Found]] = []
    for case in cases:
        try:
            both = [_found(case, way, options) for way in ("investigation", "plan")]
        except EstimatorError as error:
            yield f"{case.name}: {_truth(case)} could not be carried out: {error}"
            continue
        yield f"{case.name}: {_truth(case)}"
        yield from (
            f"  {way}: {told(found)}" for way, found in zip(("investigation", "plan"), both, strict=True)
        )
        done.append((case, both[0], both[1]))
    yield from summary(done, Rules().sure, LIMITS.force_n) if done else ()


def told(found: Found) -> str:
    """Say in one line what was found and how."""
    return (
        f"{found.answer} {100 * found.probability:.0f} % after {found.minutes:.1f} min, {found.ending}; "
        f"{', '.join(found.manoeuvres)}; force up to {found.largest_force:.1f} N; {found.seconds:.0f} s computed"
    )


def summary(done: Sequence[tuple[Planned, Found, Found]], sure: float, limit_n: float) -> Iterator[str]:
    """Give what all cases together come to."""
    cases = [case for case, _, _ in done]
    ways = {"investigation": [ours for _, ours, _ in done], "plan": [plan for _, _, plan in done]}
    for way, found in ways.items():
        right = sum(map(_is_right, cases, found))
        certain = [one for one in found if one.probability >= sure]
        yield (
            f"{way}: {right} of {len(done)} right, {len(certain)} of them or others at {100 * sure:.0f} %; "
            f"{median(one.minutes for one in found):.2f} min in the median, "
            f"{median(one.minutes for one in certain) if certain else float('nan'):.2f} of those at "
            f"{100 * sure:.0f} %; largest force {max(one.largest_force for one in found):.1f} N of {limit_n:g}"
        )
    ratio = median(one[1].minutes for one in done) / median(one[2].minutes for one in done)
    yield f"minutes of the investigation, of those of the plan: {ratio:.2f}"
    foretold = np.concatenate([one[1].foretold for one in done])
    came = np.concatenate([one[1].came for one in done])
    if len(came) > 2:
        correlation = np.corrcoef(foretold, came)[0, 1]
        yield f"information foretold and come, {len(came)} manoeuvres: correlation {correlation:.2f}"


def _found(case: Planned, way: str, options: argparse.Namespace) -> Found:
    """Return what a way has found of a case, from an earlier run where there was one."""
    folder = options.results / f"{options.seed}-{options.forms}" / case.name / way
    kept = folder / "found.json"
    if not kept.exists():
        with worker_pool() as executor:
            found = (
                _investigated(case, folder, options, executor)
                if way == "investigation"
                else _planned(case, folder, options, executor)
            )
        kept.write_text(json.dumps(asdict(found)), encoding="utf-8")
    told_before = json.loads(kept.read_text(encoding="utf-8"))
    values: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in told_before.items()
    }
    return Found(**values)


def _investigated(case: Planned, folder: Path, options: argparse.Namespace, executor: Executor) -> Found:
    started = time.perf_counter()
    laboratory = HiddenLaboratory(case, folder / f"experiments-{time.time_ns()}", options.quick)
    file = folder / "investigation.json"
    file.unlink(missing_ok=True)  # the body that remembers does not outlive an interruption
    rules = Rules(budget_s=options.budget * _MINUTE_S)
    examiner = DiagnosingExaminer(laboratory, rules.bounds, executor, silent)
    outcome = Investigation(laboratory, Willing(), rules, folder, examiner, silent).run()
    after = [entropy(list(one.probabilities.values())) for one in outcome.journal.entries]
    return Found(
        *_likeliest(outcome.probabilities),
        outcome.journal.seconds / _MINUTE_S,
        tuple(one.manoeuvre.name for one in outcome.journal.entries),
        laboratory.largest_force,
        outcome.ending,
        tuple(one.expected for one in outcome.journal.entries[1:]),
        tuple(before - later for before, later in pairwise(after)),
        time.perf_counter() - started,
    )


def _planned(case: Planned, folder: Path, options: argparse.Namespace, executor: Executor) -> Found:
    started = time.perf_counter()
    laboratory = HiddenLaboratory(case, folder / f"experiments-{time.time_ns()}", options.quick)
    trajectories = [Trial(kind, holds_s=_HOLDS_S).lay_out(Path()) for kind in STANDARD]
    folders = [laboratory.measured(one, order) for order, one in enumerate(trajectories, start=1)]
    examination = examine_in_full(examine([read_experiment(one) for one in folders], [], executor, silent))
    return Found(
        *_likeliest(examination.probability),
        sum(map(duration_s, trajectories)) / _MINUTE_S,
        tuple(STANDARD),
        laboratory.largest_force,
        "all of it done",
        (),
        (),
        time.perf_counter() - started,
    )


def _likeliest(probability: Mapping[str, float]) -> tuple[str, float]:
    return max(probability.items(), key=lambda item: item[1])


def _is_right(case: Planned, found: Found) -> bool:
    return found.answer in (case.labels or (NONE,))


def _truth(case: Planned) -> str:
    named = zip(case.labels, case.forms, case.levels, strict=True)
    return "; ".join(f"{label} ({form}, {level})" for label, form, level in named) or NONE
