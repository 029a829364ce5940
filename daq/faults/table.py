"""What a campaign found, as a table and as numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from daq.faults.checks import CHECKS, judge
from daq.faults.fault import Fault
from daq.faults.trial import Outcome


@dataclass(frozen=True, slots=True)
class Row:
    """One fault.

    Attributes
    ----------
    fault, runs : which, and how often
    passed : of each check, how often it held and to how many runs it applies
    longest_s : from the fault to the tool's standstill, the worst of all runs; None where going on is right
    """

    fault: Fault
    runs: int
    passed: dict[str, tuple[int, int]]
    longest_s: float | None

    @property
    def whole(self) -> bool:
        """Whether every check held in every run."""
        return all(held == asked for held, asked in self.passed.values())


def rows(outcomes: Sequence[Outcome], faults: Sequence[Fault]) -> list[Row]:
    """Return a row for every fault of which there are runs."""
    found = []
    for fault in faults:
        own = [outcome for outcome in outcomes if outcome.fault == fault.label]
        if not own:
            continue
        verdicts = [judge(fault, outcome) for outcome in own]
        passed = {
            check.name: (
                sum(verdict[check.name] == "" for verdict in verdicts),
                sum(verdict[check.name] is not None for verdict in verdicts),
            )
            for check in CHECKS
        }
        longest_s = max(outcome.moved_for_s for outcome in own) if fault.expected.ends == "held" else None
        found.append(Row(fault, len(own), passed, longest_s))
    return found


def complaints(outcomes: Sequence[Outcome], faults: Sequence[Fault]) -> list[str]:
    """Return a line for every check that did not hold."""
    by_label = {fault.label: fault for fault in faults}
    return [
        f"run {outcome.run} ({outcome.fault}), {check}: {complaint}"
        for outcome in sorted(outcomes, key=lambda one: one.run)
        for check, complaint in judge(by_label[outcome.fault], outcome).items()
        if complaint
    ]


def text(found: Sequence[Row]) -> str:
    """Return the table in Markdown."""
    heads = ["fault", "runs", *(check.name for check in CHECKS), "longest until it stood (bar)"]
    lines = [f"| {' | '.join(heads)} |", f"| {' | '.join('---' for _ in heads)} |"]
    for row in found:
        cells = [row.fault.label, str(row.runs), *(_share(*row.passed[check.name]) for check in CHECKS)]
        cells.append(
            "goes on"
            if row.longest_s is None
            else f"{row.longest_s:.2f} s ({row.fault.expected.within_s:g} s)"
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def as_data(found: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the same for a program."""
    return [
        {
            "fault": row.fault.label,
            "ends": row.fault.expected.ends,
            "runs": row.runs,
            "passed": {name: held for name, (held, _) in row.passed.items()},
            "asked": {name: asked for name, (_, asked) in row.passed.items()},
            "longest_s": row.longest_s,
            "bar_s": row.fault.expected.within_s if row.longest_s is not None else None,
        }
        for row in found
    ]


def _share(held: int, asked: int) -> str:
    return f"{held}/{asked}" if asked else "–"
