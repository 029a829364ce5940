"""Right and wrong answers of the diagnosis of bench tests over simulated records of every cause, size and rate."""

import argparse
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from benchmarks.bench_simulator import KNOWN, SIZES, Known, Size, drawn
from estimator.uniaxial.diagnosis import BenchDiagnosis, diagnose_bench

Grade = Literal["named", "among", "none", "unknown", "wrong"]
_GRADES: tuple[Grade, ...] = ("named", "among", "none", "unknown", "wrong")
_SURE = 0.9


@dataclass(frozen=True, slots=True)
class Graded:
    """One answer.

    Attributes
    ----------
    grade : what was put in is named, others at most as what may have a part; named with another cause, or among those
        that it can't tell apart; nothing is named; unknown; something else is named
    sure : whether the answer has nine tenths of the probability
    rate : of strain, 1/s
    gap : of the Neo-Hookean law on what is left out, of the stress
    closure : share of it that what is named closes; None where nothing is
    """

    grade: Grade
    sure: bool
    rate: float
    gap: float
    closure: float | None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what the benchmark may be told."""
    parser.add_argument(
        "--records", type=int, default=5, metavar="N", help="of each row (default: %(default)s)"
    )
    parser.add_argument(
        "--seed", type=int, default=1000, metavar="SEED", help="of the first record (default: %(default)s)"
    )
    parser.add_argument(
        "--rates", type=float, nargs="+", default=[0.01, 0.1], metavar="RATE", help="1/s (default: 0.01 0.1)"
    )
    parser.add_argument("--each", action="store_true", help="tell of every record that is not named")


def lines(options: argparse.Namespace) -> Iterator[str]:
    """Give a row for each cause and size, and the sums for each rate."""
    yield f"| put in | size | gap | {' | '.join(_GRADES)} | closed |"
    yield f"| --- | --- | --- | {' | '.join('---' for _ in _GRADES)} | --- |"
    every: list[Graded] = []
    begun = time.process_time()
    for name, known in KNOWN.items():
        for size in SIZES if known.label != "none" else SIZES[:1]:
            found = []
            for rate, number in product(options.rates, range(options.records)):
                graded, told = _one(known, size, rate, options.seed + 10 * number)
                found.append(graded)
                if options.each and graded.grade != "named":
                    yield f"{name}: {told}"
            every.extend(found)
            yield _row(name, size if known.label != "none" else "", found)
    spent = (time.process_time() - begun) / len(every)
    yield ""
    for rate in options.rates:
        yield f"{rate:g} per second: {_sums([one for one in every if one.rate == rate])}"
    yield f"{spent:.2f} s of processor for each record"


def grade(found: BenchDiagnosis, label: str) -> Grade:
    """Hold a diagnosis against what was put in."""
    if found.verdict == (label,) and all(label in answer for answer in found.alike):
        return "named"
    if any(label in answer for answer in (found.verdict, *found.alike)):
        return "among"
    if found.verdict == ("none",):
        return "none"
    return "unknown" if found.verdict == ("unknown",) and not found.alike else "wrong"


def _one(known: Known, size: Size, rate: float, seed: int) -> tuple[Graded, str]:
    record = drawn(known, size, rate, seed)
    found = diagnose_bench([record])
    sure = max(found.ranking.probabilities.values()) >= _SURE
    closure = None if found.verdict in (("none",), ("unknown",)) else found.held_out.closure
    graded = Graded(grade(found, known.label), sure, rate, found.held_out.gap_before, closure)
    answers = " or ".join(" with ".join(answer) for answer in (found.verdict, *found.alike))
    return graded, f"{record.name}: {answers}"


def _row(name: str, size: str, found: Sequence[Graded]) -> str:
    count = Counter(one.grade for one in found)
    gap = f"{100 * np.median([one.gap for one in found]):.2g} %"
    closed = [one.closure for one in found if one.closure is not None]
    shown = f"{round(100 * float(np.median(closed)))} %" if closed else ""
    cells = [name, size, gap, *(str(count[one] or "") for one in _GRADES), shown]
    return f"| {' | '.join(cells)} |"


def _sums(every: Sequence[Graded]) -> str:
    count = Counter(one.grade for one in every)
    sure = sum(one.grade == "wrong" and one.sure for one in every)
    told = ", ".join(f"{count[one]} {one}" for one in _GRADES)
    return f"{len(every)} records: {told}, of which {sure} sure"
