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
from statistics import median
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


@dataclass(frozen=True, slots=True)
class Build:
    """A build that diagnoses.

    Attributes
    ----------
    name : in the names of its results; None where what it is may change, so that no result of it is kept
    python : its interpreter
    tree : the folder of its modules
    """

    name: str | None
    python: Path
    tree: Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what the benchmark needs to know."""
    parser.add_argument("cases", nargs="+", type=Path, metavar="CASE", help="a folder of experiments each")
    parser.add_argument("--against", required=True, metavar="COMMIT", help="the build of comparison")
    parser.add_argument(
        "--this-environment",
        action="store_true",
        help="the other commit runs in the environment of this one, as it may where both need the same packages; "
        "without it, its own run.py makes one",
    )
    parser.add_argument(
        "--results",
        type=Path,
        default=Path("runs/diagnosis"),
        metavar="DIR",
        help="the other build with its environment, and what is done: a later run goes on, also with other cases, "
        "but diagnoses anew by a build with changes that are in no commit (default: %(default)s)",
    )


def lines(options: argparse.Namespace) -> Iterator[str]:
    """Give a line for each case, and the sums."""
    results: Path = options.results.resolve()
    commit = _said_by_git("rev-parse", "--short=10", f"{options.against}^{{commit}}")
    yield f"setting up {commit} in {results}"
    tree = _checked_out(commit, results / "build")
    other = Build(commit, Path(sys.executable) if options.this_environment else _environment_made(tree), tree)
    own = _said_by_git("describe", "--always", "--abbrev=10", "--exclude=*", "--dirty")
    this = Build(None if own.endswith("-dirty") else own, Path(sys.executable), _ROOT)
    yield from in_turn(options.cases, (this, other), results)


def in_turn(cases: Sequence[Path], builds: tuple[Build, Build], results: Path) -> Iterator[str]:
    """Give a line for each case, diagnosed by one build and then by the other, and the sums of all that both could.

    Raises
    ------
    InputError
        In the end, where a case could not be diagnosed.
    """
    yield "case: processor s, wall s, MB, verdict, E in kPa, nu of this build | of the other | their ratio"
    costs: list[tuple[Cost, Cost]] = []
    failed = []
    for case in cases:
        try:
            (cost, answer), (other_cost, other_answer) = (
                diagnosed(build, case.resolve(), results) for build in builds
            )
        except InputError as error:
            failed.append(case.name)
            yield f"{case.name}: {error}"
            continue
        costs.append((cost, other_cost))
        yield (
            f"{case.name}: {told(cost, answer)} | {told(other_cost, other_answer)} | {ratios(*costs[-1])}, "
            f"{agreement(answer, other_answer)}"
        )
    if costs:
        this, other = (reduce(_together, side) for side in zip(*costs, strict=True))
        walls = [cost.wall_s for cost, _ in costs]
        yield (
            f"all: {ratios(this, other)}; this build's wall time: median {median(walls):.0f} s, "
            f"slowest {max(walls):.0f} s"
        )
    if failed:
        raise InputError(f"{', '.join(failed)}: not diagnosed; see above, mend it, and run this again")


def diagnosed(build: Build, case: Path, results: Path) -> tuple[Cost, Answer]:
    """Diagnose a case, or return what an earlier run with the same results has found.

    Raises
    ------
    InputError
        The build could not.
    """
    kept_as = results / f"{case.parent.name}-{case.name}-{build.name}.json"
    if build.name is not None and kept_as.exists():
        kept = json.loads(kept_as.read_text(encoding="utf-8"))
    else:
        command = [str(build.python), "-m", "daq.cli", "diagnose", str(case), "--json"]
        cost, printed = measured(command, build.tree)
        kept = {"cost": asdict(cost), "diagnosis": json.loads(printed)}
        if build.name is not None:
            results.mkdir(parents=True, exist_ok=True)
            draft = kept_as.with_suffix(".partial")
            draft.write_text(json.dumps(kept), encoding="utf-8")
            draft.replace(kept_as)
    return Cost(**kept["cost"]), answer_of(kept["diagnosis"])


def agreement(this: Answer, other: Answer) -> str:
    """Say whether two answers name the same, and how far E and nu lie apart in the other's deviations."""
    apart = [
        _deviations_apart(this.youngs_modulus, other.youngs_modulus),
        _deviations_apart(this.poisson_ratio, other.poisson_ratio),
    ]
    same = "the same verdict" if this.verdict == other.verdict else "ANOTHER VERDICT"
    return f"{same}, E {apart[0]:.3f} and nu {apart[1]:.3f} deviations apart"


def _deviations_apart(this: Estimate | None, other: Estimate | None) -> float:
    """Return how far two values lie apart in the second's deviations; NaN where one is not told."""
    if this is None or other is None:
        return float("nan")
    deviation = (other.high - other.low) / (2 * Z95)
    return abs(this.value - other.value) / deviation if deviation else float(this.value != other.value)


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


def _said_by_git(*words: str) -> str:
    """Return what git says of this repository."""
    done = subprocess.run(["git", *words], cwd=_ROOT, capture_output=True, encoding="utf-8", check=False)
    if done.returncode:
        raise InputError(
            f"git {' '.join(words)}: {done.stderr.strip()}; name a commit of this repository, in a clone of it"
        )
    return done.stdout.strip()


def _checked_out(commit: str, build: Path) -> Path:
    """Return the folder of another build, checked out where it is not there yet."""
    tree = build / commit
    if not tree.exists():
        _said_by_git("worktree", "add", "--detach", str(tree), commit)
    return tree


def _environment_made(tree: Path) -> Path:
    """Return the interpreter of another build's own environment, which its run.py sets up."""
    subprocess.run([sys.executable, "run.py", "--version"], cwd=tree, env=_environment_of(tree), check=False)
    python = tree / ".venv" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    if not python.exists():
        raise InputError(f"{tree}: its run.py made no environment; run it there and look at what it says")
    return python


def _environment_of(tree: Path) -> dict[str, Any]:
    """Return an environment in which Python finds the modules of this folder before all others."""
    return {**os.environ, "PYTHONPATH": str(tree)}


def _together(one: Cost, other: Cost) -> Cost:
    """Return the cost of both, one after the other."""
    return Cost(one.wall_s + other.wall_s, one.cpu_s + other.cpu_s, max(one.memory_mb, other.memory_mb))
