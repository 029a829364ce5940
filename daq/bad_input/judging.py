"""One broken form of an input, presented to its reader and its verb, and what they made of it."""

import hashlib
import os
import re
import shutil
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random

from daq.bad_input.damage.value import CANARY
from daq.bad_input.kind import Kind
from daq.bad_input.watch import watched
from daq.cli import main
from daq.cli.verb import Result, concluded
from robot_drivers.fuzzing.bounds import HangError, time_bound, waiting_bound

LONGEST_S = 10.0
"""CPU time after which a form is said to hang its reader."""

LONGEST_WAIT_S = 60.0
"""Time after which it is said to wait for something that never comes."""

_PLACE_SHARE = 0.08
_LONGEST_LINE = 1500
_REFUSED = 2
_SOUND = "sound"


@dataclass(frozen=True, slots=True)
class Form:
    """A broken form: the number and the seed reproduce it."""

    kind: Kind
    seed: int
    number: int

    @property
    def random(self) -> Random:
        """Random numbers that belong to this form alone."""
        return Random(f"{self.seed} {self.kind.name} {self.number}")


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of a form.

    Attributes
    ----------
    damage : what was done to the file
    refused : whether it was refused; a damage may leave a valid file
    told : the line on standard error
    complaint : what is wrong with the behaviour; empty where nothing is
    """

    damage: str
    refused: bool
    told: str
    complaint: str


def judge(form: Form, template: Path) -> Verdict:
    """Break a copy of a valid input, present it, and judge.

    A form that is refused has to be refused by reader and verb alike: exit status 2, one line, no traceback, nothing
    written, nothing changed, nothing executed.

    Parameters
    ----------
    template : folder of the valid input
    """
    with tempfile.TemporaryDirectory(prefix="bad-input-") as folder:
        place = Path(folder)
        given, out = place / "given", place / "out"
        shutil.copytree(template, given, symlinks=True)
        out.mkdir()
        damage = _break(form, given)
        before = _contents(given)
        status, told, complaint = _presented(lambda: _read(form.kind, given), out)
        refused = status == _REFUSED
        if not complaint and refused:
            complaint = _misconduct(told)
            command = form.kind.command
            if not complaint and command is not None:
                status, told, complaint = _presented(lambda: main([*command(given, out), "--json"]), out)
                complaint = complaint or _status_other_than_refused(status) or _misconduct(told)
            complaint = complaint or _traces(form.kind, place, before)
        elif not complaint and form.kind.quick and form.kind.command is not None:
            told, complaint = _carried_out(form.kind.command(given, out), out)
        return Verdict(damage, refused, told, complaint)


def _carried_out(command: Sequence[str], out: Path) -> tuple[str, str]:
    """Carry out a verb on a form that its reader took; return the last line that it told, and a complaint.

    It may end well, or refuse in the end what cannot be right, with nothing written.
    """
    status, told, complaint = _presented(lambda: main([*command, "--json"]), out)
    last = told.splitlines(keepends=True)[-1:]
    if complaint or status == 0:
        return "".join(last), complaint or _warning_in(told)
    complaint = _status_other_than_refused(status) or _misconduct("".join(last)) or _warning_in(told)
    written = ", ".join(sorted(path.name for path in out.iterdir())[:4])
    return "".join(last), complaint or (f"refused, and wrote {written}" if written else "")


def _warning_in(told: str) -> str:
    """Return a warning of a library, which is no word to a user."""
    lines = [line for line in told.splitlines() if re.search(r"\w+Warning: |^Traceback", line)]
    return f"a warning on standard error: {lines[0][:300]!r}" if lines else ""


def _break(form: Form, given: Path) -> str:
    """Damage one file of the input; return what was done, in words."""
    random = form.random
    pattern = random.choice(list(form.kind.damages))
    file = next(iter(sorted(given.glob(pattern))))
    if random.random() < _PLACE_SHARE:
        place = random.choice(form.kind.places)
        place(file)
        return f"{file.name}: {place.__name__}"
    damage = random.choice(form.kind.damages[pattern])
    file.write_bytes(damage(random, file.read_bytes()))
    return f"{file.name}: {damage.__name__}"


def _read(kind: Kind, given: Path) -> int:
    def run() -> Result:
        kind.read(given)
        return Result(_SOUND, {})

    return concluded(run, as_json=False)


def _presented(call: Callable[[], int], out: Path) -> tuple[int, str, str]:
    """Return exit status, standard error and a complaint, empty if there is none."""
    status, complaint = -1, ""
    with _quiet(out) as errors, time_bound() as bound, watched() as forbidden:
        try:
            bound(LONGEST_S)
            with waiting_bound(LONGEST_WAIT_S):
                status = call()
        except HangError:
            complaint = f"needs more than {LONGEST_S:g} s, or waits for more than {LONGEST_WAIT_S:g} s"
        except SystemExit as end:
            status = int(end.code) if isinstance(end.code, int) else 1
        except BaseException as error:  # noqa: BLE001 - whatever escapes a verb is what this program looks for
            last = traceback.extract_tb(error.__traceback__)[-1]
            complaint = f"{type(error).__name__}: {error} ({Path(last.filename).name}, line {last.lineno})"
        finally:
            bound(0.0)
    if not complaint and forbidden:
        complaint = f"executed something: {forbidden[0]}"
    return status, errors(), " ".join(complaint.split())[:400]


def _misconduct(told: str) -> str:
    """Return what is wrong with what a refusal wrote to standard error."""
    lines = told.splitlines()
    if len(lines) != 1:
        return f"{len(lines)} lines on standard error: {told[:300]!r}"
    if not lines[0].startswith("retract: "):
        return f"a line that is no complaint of the verb: {told[:300]!r}"
    if len(lines[0]) > _LONGEST_LINE:
        return f"a line of {len(lines[0])} characters: {told[:200]!r}"
    if any(not character.isprintable() for character in lines[0]):
        return f"a line with control characters: {told[:300]!r}"
    return ""


def _status_other_than_refused(status: int) -> str:
    return "" if status == _REFUSED else f"the verb ends with status {status}"


def _traces(kind: Kind, place: Path, before: dict[str, str]) -> str:
    """Return what a refusal has left behind."""
    if written := sorted(path.name for path in (place / "out").rglob("*")):
        return f"wrote {', '.join(written[:4])}"
    if strays := sorted({path.name for path in place.iterdir()} - {"given", "out"}):
        return f"wrote {strays[0]} outside of its folder"
    after = _contents(place / "given")
    changed = [name for name in after.keys() | before.keys() if after.get(name) != before.get(name)]
    if altered := sorted(name for name in changed if Path(name).name not in kind.changes):
        return f"changed {altered[0]} of the input"
    elsewhere = Path(tempfile.gettempdir()) / CANARY
    return f"wrote {elsewhere}" if elsewhere.exists() else ""


def _contents(folder: Path) -> dict[str, str]:
    """Return what is in a folder, by the names of its files."""
    found = {}
    for path in sorted(folder.rglob("*")):
        whole = path.is_file() and not path.is_symlink() and path.stat().st_size < 10_000_000
        told = hashlib.sha256(path.read_bytes()).hexdigest() if whole else f"mode {path.lstat().st_mode}"
        found[path.relative_to(folder).as_posix()] = told
    return found


@contextmanager
def _quiet(folder: Path) -> Iterator[Callable[[], str]]:
    """Go into a folder and keep what is written to standard output and error; give what error has got, in the end."""
    here = Path.cwd()
    kept = ""
    with tempfile.TemporaryFile("w+b") as errors, open(os.devnull, "w", encoding="utf-8") as nowhere:  # noqa: PTH123
        saved_error, saved_streams = os.dup(2), (sys.stdout, sys.stderr)
        with os.fdopen(os.dup(errors.fileno()), "w", encoding="utf-8", errors="replace") as stream:
            try:
                os.dup2(errors.fileno(), 2)  # libraries in C write there
                sys.stdout, sys.stderr = nowhere, stream
                os.chdir(folder)
                with warnings.catch_warnings(record=True) as seen:
                    warnings.simplefilter("always")
                    yield lambda: kept
                    stream.writelines(f"{one.category.__name__}: {one.message}\n" for one in seen)
            finally:
                os.chdir(here)
                sys.stdout, sys.stderr = saved_streams
                os.dup2(saved_error, 2)
                os.close(saved_error)
        errors.seek(0)
        kept = errors.read().decode("utf-8", "replace")
