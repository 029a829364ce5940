"""What the verbs share: their options, their results on standard output, progress and complaints on standard error."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeAlias

from rich import progress as rich_progress
from rich.console import Console

from daq.cli.ending import Terminated
from daq.errors import DaqError
from daq.progress import Progress
from estimator.errors import EstimatorError
from robot_drivers.errors import DeviceError

# more than any complaint needs; what a file says within one may be without end
_LONGEST_LINE = 1000

Verbs: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


@dataclass(frozen=True, slots=True)
class Result:
    """What a verb has to say, to a person or with ``--json`` to a program, and its exit status."""

    text: str
    data: dict[str, Any]
    status: int = 0


def add_verb(
    verbs: Verbs, name: str, summary: str, examples: str, run: Callable[[argparse.Namespace], Result]
) -> argparse.ArgumentParser:
    """Add a verb with its option ``--json`` and return its parser for further options."""
    parser = verbs.add_parser(
        name,
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}.",
        epilog=f"examples:\n{examples}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    parser.set_defaults(run=run)
    return parser


def concluded(run: Callable[[], Result], *, as_json: bool) -> int:
    """Run a verb, write its result or one line on why there is none, and return the exit status."""
    try:
        result = run()
    except (DaqError, EstimatorError, DeviceError) as error:
        return fail(str(error), status=2)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""  # a socket has none
        return fail(f"{where}{error.strerror or error}", status=2)
    except Terminated as ended:
        return fail(str(ended), status=ended.status)
    except KeyboardInterrupt as interrupt:
        return fail(str(interrupt) or "interrupted", status=130)
    write(json.dumps(result.data) if as_json else result.text)
    return result.status


def write(text: str) -> None:
    """Write the result to standard output."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def fail(complaint: str, status: int) -> int:
    """Write one line to standard error, whatever a file has put into the complaint, and return the exit status."""
    line = " ".join(complaint.split())
    shown = "".join(one if one.isprintable() else repr(one)[1:-1] for one in line)
    if len(shown) > _LONGEST_LINE:
        shown = f"{shown[: _LONGEST_LINE // 2]} ... {shown[-_LONGEST_LINE // 2 :]}"
    sys.stderr.write(f"retract: {shown}\n")
    return status


@contextmanager
def progress() -> Iterator[Progress]:
    """Show what is going on, on standard error: a bar on a terminal, otherwise a line for each stage."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _line_teller()
        return
    columns = (
        rich_progress.TextColumn("{task.description}"),
        rich_progress.BarColumn(),
        rich_progress.TimeElapsedColumn(),
    )
    with rich_progress.Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=None)

        def tell(text: str, done: int, total: int) -> None:
            bar.update(task, description=text, completed=done, total=total)

        yield tell


def _line_teller() -> Progress:
    last = ""

    def tell(text: str, done: int, total: int) -> None:
        nonlocal last
        if text != last:
            sys.stderr.write(f"{text}\n")
            last = text

    return tell
