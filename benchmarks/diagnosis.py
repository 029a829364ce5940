"""Diagnoses by this build and by another commit, in turn: time, memory and answers side by side."""

import argparse
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import reduce
from pathlib import Path
from typing import Any

from estimator.blind.scoring.answers import Answer, Estimate
from estimator.blind.scoring.diagnoses import answer_of
from estimator.errors import InputError
from estimator.inference.normal import Z95

_ROOT = Path(__file__).resolve().parents[1]
_LOOK_S = 0.25
_PROC = Path("/proc")


@dataclass(frozen=True, slots=True)
class Cost:
    """What a run took: seconds on the clock, seconds of processors, most memory of all its processes together, MB.

    The memory is NaN where the system does not tell it.
    """

    wall_s: float
    cpu_s: float
    memory_mb: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what the benchmark needs to know."""
    parser.add_argument("cases", nargs="+", type=Path, metavar="CASE", help="a folder of experiments each")
    parser.add_argument("--against", required=True, metavar="COMMIT", help="the build of comparison")
    parser.add_argument(
        "--results",
        type=Path,
        default=Path("runs/diagnosis"),
        metavar="DIR",
        help="the other build with its environment, and what is done; a later run goes on (default: %(default)s)",
    )


def lines(options: argparse.Namespace) -> Iterator[str]:
    """Give a line for each case, and the sums."""
    results: Path = options.results.resolve()
    yield f"setting up {options.against} in {results}"
    theirs = _checked_out(options.against, results / "build")
    yield "case: processor s, wall s, MB, verdict, E in kPa, nu of this build | of the other | their ratio"
    costs: list[tuple[Cost, Cost]] = []
    for case in options.cases:
        runs = [
            _run(python, tree, case.resolve(), results / f"{case.name}-{name}.json")
            for name, python, tree in (("this", Path(sys.executable), _ROOT), ("other", *theirs))
        ]
        costs.append((runs[0][0], runs[1][0]))
        yield f"{case.name}: {' | '.join(told(*run) for run in runs)} | {ratios(*costs[-1])}"
        if runs[0][1].verdict != runs[1][1].verdict:
            yield f"{case.name}: the verdicts differ"
    sums = [reduce(_together, side) for side in zip(*costs, strict=True)]
    yield f"all: {ratios(sums[0], sums[1])}"


def told(cost: Cost, answer: Answer) -> str:
    """Say in one line what a diagnosis took and what it found."""
    return (
        f"{cost.cpu_s:.0f} s, {cost.wall_s:.0f} s, {cost.memory_mb:.0f} MB, {' + '.join(answer.verdict) or 'none'}, "
        f"{_told(answer.youngs_modulus, 1e3, 3)}, {_told(answer.poisson_ratio, 1.0, 4)}"
    )


def _told(found: Estimate | None, unit: float, digits: int) -> str:
    """Say a value with its standard deviation, in a unit."""
    if found is None:
        return "-"
    return f"{found.value / unit:.{digits}f} +- {(found.high - found.low) / (2 * Z95 * unit):.{digits}f}"


def ratios(this: Cost, other: Cost) -> str:
    """Say what share of the other's cost this one is."""
    return (
        f"processors {this.cpu_s / other.cpu_s:.2f}, wall {this.wall_s / other.wall_s:.2f}, "
        f"memory {this.memory_mb / other.memory_mb:.2f}"
    )


def measured(command: Sequence[str], tree: Path) -> tuple[Cost, str]:
    """Run a command in a folder and return what it took, with everything that it started, and what it printed.

    Raises
    ------
    InputError
        It failed.
    """
    before, began = os.times(), time.perf_counter()
    with subprocess.Popen(
        command,
        cwd=tree,
        env=_environment_of(tree),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
    ) as process:
        watch = _MemoryWatch(process.pid)
        printed, complaints = process.communicate()
        most_mb = watch.stop()
    wall_s, after = time.perf_counter() - began, os.times()
    if process.returncode:
        raise InputError(f"{' '.join(command)} ended with {process.returncode}: {complaints.strip()[-300:]}")
    cpu_s = after.children_user + after.children_system - before.children_user - before.children_system
    return Cost(wall_s, cpu_s, most_mb), printed


class _MemoryWatch:
    """Looks, until it is stopped, at the memory of a process and all below it; what they share counts once."""

    def __init__(self, process_id: int) -> None:
        self._first = process_id
        self._most_mb = float("nan")
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self._thread.start()

    def stop(self) -> float:
        """Return the most there was, MB."""
        self._stopping.set()
        self._thread.join()
        return self._most_mb

    def _look(self) -> None:
        while _PROC.exists() and not self._stopping.wait(_LOOK_S):
            now_mb = sum(map(_proportional_mb, _tree_of(self._first)))
            self._most_mb = max(now_mb, 0.0 if self._most_mb != self._most_mb else self._most_mb)


def _tree_of(process_id: int) -> list[int]:
    """Return a process and everything below it."""
    try:
        children = " ".join(
            file.read_text(encoding="ascii") for file in (_PROC / str(process_id) / "task").glob("*/children")
        ).split()
    except OSError:
        return []
    return [process_id, *(one for child in children for one in _tree_of(int(child)))]


def _proportional_mb(process_id: int) -> float:
    try:
        text = (_PROC / str(process_id) / "smaps_rollup").read_text(encoding="ascii")
    except OSError:
        return 0.0
    return sum(float(line.split()[1]) for line in text.splitlines() if line.startswith("Pss:")) / 1024.0


def _checked_out(commit: str, build: Path) -> tuple[Path, Path]:
    """Return the interpreter and the folder of another build, made and set up where it is not there yet."""
    tree = build / commit
    if not tree.exists():
        added = subprocess.run(
            ["git", "worktree", "add", "--detach", str(tree), commit],
            cwd=_ROOT,
            capture_output=True,
            encoding="utf-8",
            check=False,
        )
        if added.returncode:
            raise InputError(
                f"{commit}: cannot be checked out ({added.stderr.strip()}); name a commit of this repository"
            )
    subprocess.run([sys.executable, "run.py", "--version"], cwd=tree, env=_environment_of(tree), check=False)
    python = tree / ".venv" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    if not python.exists():
        raise InputError(f"{tree}: its run.py made no environment; run it there and look at what it says")
    return python, tree


def _run(python: Path, tree: Path, case: Path, result: Path) -> tuple[Cost, Answer]:
    """Diagnose a case, or return what an earlier run has found."""
    if result.exists():
        kept = json.loads(result.read_text(encoding="utf-8"))
    else:
        cost, printed = measured([str(python), "-m", "daq.cli", "diagnose", str(case), "--json"], tree)
        kept = {"cost": asdict(cost), "diagnosis": json.loads(printed)}
        draft = result.with_suffix(".partial")
        draft.write_text(json.dumps(kept), encoding="utf-8")
        draft.replace(result)
    return Cost(**kept["cost"]), answer_of(kept["diagnosis"])


def _environment_of(tree: Path) -> dict[str, Any]:
    """Return an environment in which Python finds the modules of this folder before all others."""
    return {**os.environ, "PYTHONPATH": str(tree)}


def _together(one: Cost, other: Cost) -> Cost:
    """Return the cost of both, one after the other."""
    return Cost(one.wall_s + other.wall_s, one.cpu_s + other.cpu_s, max(one.memory_mb, other.memory_mb))
