"""Damage sessions in seeded ways, recover them, and compare what comes of it with what was recorded.

Blocks are overwritten, removed, put in, zeroed, repeated and exchanged, bits flipped, files cut, at any place of any
file of a small session that was sealed or cut off. Nothing undamaged may be lost, nothing damaged used, nothing
written over before its successor was read back, and the told loss has to be the true one.

Examples::

    python -m daq.bad_input.recovery_campaign --count 10000 --seed 1 --results results.jsonl
    python -m daq.bad_input.recovery_campaign --seed 1 --first 31 --count 1 --tell     one again

With --results the campaign goes on where it was interrupted. The exit status is 1 where something was found.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

from daq.bad_input.recovery.checks import judge
from daq.bad_input.recovery.originals import Original, originals
from estimator.result_lines import append_result, read_results

_IN_MEMORY = Path("/dev/shm")  # a disk would have to be waited for ten times a session


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one damaged session; as :class:`~daq.bad_input.recovery.checks.Verdict`, with what repeats it."""

    seed: int
    number: int
    damage: str
    outcome: str
    lost: int
    told: int
    estimated: bool
    complaint: str


def carry_out(sessions: Sequence[Original], seed: int, number: int, folder: Path) -> Outcome:
    """Carry out one damage in a new folder within an existing one."""
    random = Random(f"{seed} {number}")
    original = random.choice(sessions)
    with tempfile.TemporaryDirectory(dir=folder) as place:
        verdict = judge(original, random, Path(place))
    return Outcome(
        seed,
        number,
        verdict.damage,
        verdict.outcome,
        verdict.lost,
        verdict.told,
        verdict.estimated,
        verdict.complaint,
    )


def table(outcomes: Iterable[Outcome]) -> str:
    """Return counts by damage."""
    rows: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for one in outcomes:
        for name in (one.damage.rpartition(": ")[2], "all"):
            row = rows[name]
            row["sessions"] += 1
            row[one.outcome] += 1
            row["lost"] += one.lost
            row["told"] += one.told
            row["estimated"] += one.estimated
            row["findings"] += bool(one.complaint)
    columns = ("sessions", "unchanged", "refused", "recovered", "lost", "told", "estimated", "findings")
    lines = [f"{'damage':28}" + "".join(f"{name:>11}" for name in columns)]
    for name in [*sorted(set(rows) - {"all"}), *(["all"] if rows else [])]:
        lines.append(f"{name:28}" + "".join(f"{rows[name][column]:>11}" for column in columns))
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a campaign."""
    parser = argparse.ArgumentParser(
        prog="python -m daq.bad_input.recovery_campaign",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--count", type=int, default=200, help="damaged sessions (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="default %(default)s")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--results", type=Path, help="file of results; those in it are not repeated")
    parser.add_argument("--tell", action="store_true", help="write what comes of each to standard error")
    options = parser.parse_args(arguments)
    if options.count < 1 or options.first < 0:
        parser.error("--count must be positive, --first not negative")
    kept = read_results(Outcome, options.results) if options.results else []
    done = {one.number: one for one in kept if one.seed == options.seed}
    begin_s = time.monotonic()
    try:
        _run(options, done)
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
    numbers = range(options.first, options.first + options.count)
    chosen = [done[number] for number in numbers if number in done]
    sys.stdout.write(f"{table(chosen)}\n{time.monotonic() - begin_s:.0f} s\n")
    return 1 if any(one.complaint for one in chosen) else 0


def _run(options: argparse.Namespace, done: dict[int, Outcome]) -> None:
    """Carry out what is not done yet, and add it."""
    memory = str(_IN_MEMORY) if _IN_MEMORY.is_dir() else None
    with tempfile.TemporaryDirectory(prefix="recovery-", dir=memory) as folder:
        sessions = originals(Path(folder))
        for number in range(options.first, options.first + options.count):
            if number in done:
                continue
            outcome = done[number] = carry_out(sessions, options.seed, number, Path(folder))
            if options.results:
                append_result(options.results, outcome)
            if outcome.complaint or options.tell:
                kind = "FINDING" if outcome.complaint else outcome.outcome
                sys.stderr.write(
                    f"{number} {kind}, {outcome.damage}: lost {outcome.lost}, told {outcome.told} {outcome.complaint}\n"
                )


if __name__ == "__main__":
    sys.exit(main())
