"""``retract benchmark enter`` and ``leaderboard``: anyone's answers, validated and ranked."""

import argparse
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb
from estimator.blind.leaderboard.ranking import ranked
from estimator.blind.leaderboard.telling import check_writable, leaderboard_text, write_leaderboard
from estimator.blind.scoring.entries.entry import Entry, examine, read_entry
from estimator.blind.scoring.entries.schema import Fault
from estimator.blind.sealing.commitment import check_cases, read_commitment
from estimator.blind.sealing.register import register

_ENTER_EXAMPLES = """  retract benchmark enter answers.json
  retract benchmark enter answers.json --cases sealed/cases
  retract benchmark enter answers.json --cases sealed/cases --register sealed/keys

Each fault is one line: where, what, and what to do; exit status 2. docs/challenge.md has the format."""
_LEADERBOARD_EXAMPLES = """  retract benchmark leaderboard sealed/keys ours.json thresholds.json
  retract benchmark leaderboard sealed/keys *.json --output leaderboard.md --json"""
_MOST_FAULTS = 100


def add_enter(actions: Verbs) -> None:
    """Add the action that validates answers."""
    summary = "validate anyone's answers, and tell how to have them scored"
    parser = add_verb(actions, "enter", summary, _ENTER_EXAMPLES, _enter)
    parser.add_argument("answers", type=Path, metavar="ANSWERS", help="file of retraction-answers/1")
    parser.add_argument(
        "--cases", type=Path, metavar="DIR", help="the published cases, to check that each is answered"
    )
    parser.add_argument(
        "--register",
        type=Path,
        metavar="KEYS",
        help="for who keeps the keys: write date and hash of the answers beside them, before they are opened",
    )


def add_leaderboard(actions: Verbs) -> None:
    """Add the action that ranks entries."""
    parser = add_verb(
        actions, "leaderboard", "rank entries by the keys of their set", _LEADERBOARD_EXAMPLES, _leaderboard
    )
    parser.add_argument(
        "keys", type=Path, metavar="KEYS", help="folder of the keys; the opening is counted in it"
    )
    parser.add_argument(
        "answers", type=Path, nargs="+", metavar="ANSWERS", help="files of retraction-answers/1"
    )
    parser.add_argument("--output", type=Path, metavar="FILE", help="write a page (.md or .html)")


def _enter(options: argparse.Namespace) -> Result:
    published = None
    if options.cases is not None:
        published = read_commitment(options.cases)
        check_cases(options.cases, published)
    entry, faults = examine(options.answers, published)
    if entry is None:
        return _refused(options.answers, faults)
    lines = [
        f"{options.answers}: nothing is wrong with {len(entry.answers)} answers of {entry.name!r}",
        f"set {entry.set_hash}"
        + ("" if published else " (give --cases to check that it is theirs, and answered whole)"),
        f"sha256 {entry.answers_hash}: tell it to who keeps the keys before they are opened",
    ]
    if options.register is not None:
        date = register(options.register, entry.answers_hash, entry.name)
        lines.append(f"registered in {options.register} at {date.isoformat()}")
    lines.append(f"to have it scored: retract benchmark leaderboard KEYS {options.answers}")
    return Result("\n".join(lines), _data(entry))


def _refused(file: Path, faults: list[Fault]) -> Result:
    lines = [f"{file}: {fault}" for fault in faults[:_MOST_FAULTS]]
    if more := len(faults) - _MOST_FAULTS:
        lines += [f"{file}: and {more} more"] if more > 0 else []
    data = {
        "entered": False,
        "faults": [{"where": one.where, "what": one.what, "advice": one.advice} for one in faults],
    }
    return Result("\n".join(lines), data, status=2)


def _data(entry: Entry) -> dict[str, object]:
    return {
        "entered": True,
        "name": entry.name,
        "set": entry.set_hash,
        "sha256": entry.answers_hash,
        "answered": entry.answered.isoformat(),
        "cases": sorted(entry.answers),
        "faults": [],
    }


def _leaderboard(options: argparse.Namespace) -> Result:
    if options.output is not None:
        check_writable(options.output)
    board = ranked([read_entry(file) for file in options.answers], options.keys)
    if options.output is not None:
        write_leaderboard(board, options.output)
    return Result(leaderboard_text(board), board.as_json())
