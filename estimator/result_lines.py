"""Results of a long campaign, one line of JSON each in a file, so that the campaign goes on after a stop.

A line that was cut off, as by a loss of power, is left out where the file is read and ended where it is continued.
"""

import dataclasses
import json
from pathlib import Path
from typing import TypeVar

from estimator.errors import InputError
from estimator.input_file import parse_json, read_input, read_input_text
from estimator.json_dataclass import from_json

T = TypeVar("T")

_MOST_BYTES = 50_000_000


def read_results(kind: type[T], file: Path) -> list[T]:
    """Return the results in a file, none where there is no file yet.

    Parameters
    ----------
    kind : the dataclass of a result, as :func:`~estimator.json_dataclass.from_json` takes it

    Raises
    ------
    InputError
        The file cannot be read, or a whole line of it is no such result.
    """
    if not _is_there(file):
        return []
    whole_lines = read_input_text(file, _MOST_BYTES).split("\n")[:-1]
    return [_result(kind, line, file, number) for number, line in enumerate(whole_lines, start=1)]


def append_result(file: Path, result: object) -> None:
    """Append a result, a dataclass instance, to a file in an existing folder.

    Raises
    ------
    InputError
        Something else than a file stands there.
    """
    whole = _up_to_last_line(read_input(file, _MOST_BYTES)) if _is_there(file) else 0
    with file.open("ab") as stream:
        stream.truncate(whole)
        stream.write(f"{json.dumps(dataclasses.asdict(result))}\n".encode())  # type: ignore[call-overload] # stated


def _is_there(file: Path) -> bool:
    return file.is_symlink() or file.exists()


def _up_to_last_line(content: bytes) -> int:
    return content.rfind(b"\n") + 1


def _result(kind: type[T], line: str, file: Path, number: int) -> T:
    try:
        return from_json(kind, parse_json(line, file))
    except ValueError as error:
        raise InputError(f"{file}, line {number}: {error}; remove the line, or name another file") from None
