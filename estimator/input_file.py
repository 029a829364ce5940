"""Files that a user hands over: regular ones of bounded size, decoded, or one line that says why not.

A device or a pipe in the place of a file would never end, and a file of the wrong kind may be larger than memory;
neither is opened.
"""

import json
import re
import stat
import tomllib
from pathlib import Path
from typing import Any, TypeGuard

from estimator.errors import InputError

MOST_TEXT_BYTES = 50_000_000
"""Largest file of text that is read at once: hours of a retraction's observations."""


LARGEST_NUMBER = 1e100
"""Beyond any quantity of a laboratory in any unit, and small enough to be squared."""

_DECIMAL = re.compile(
    r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.ASCII | re.IGNORECASE
)


def read_input(file: Path, most_bytes: int) -> bytes:
    """Return the content of a regular file.

    Raises
    ------
    InputError
        There is none, it is something else than a regular file, may not be read, or is larger than ``most_bytes``.
    """
    size = require_file(file)
    if size > most_bytes:
        raise InputError(
            f"{file}: {size / 1e6:.0f} MB, and at most {most_bytes / 1e6:.0f} MB are read; is it the right file?"
        )
    try:
        return file.read_bytes()
    except OSError as error:
        raise InputError(
            f"{file}: cannot be read ({error.strerror}); allow it, or name another file"
        ) from None


def require_file(file: Path) -> int:
    """Return the size of a regular file, in bytes.

    Raises
    ------
    InputError
        There is none, or it is something else than a regular file.
    """
    try:
        found = file.stat()
        if not stat.S_ISREG(found.st_mode):
            raise InputError(f"{file}: is a {_kind(found.st_mode)}; name a file")
        return found.st_size
    except FileNotFoundError:
        raise InputError(f"{file}: there is no such file; name an existing one") from None
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        # ValueError: a name that no file can have
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"{str(file)!r}: cannot be read ({reason}); name another file") from None


def read_input_text(file: Path, most_bytes: int = MOST_TEXT_BYTES) -> str:
    """Return the text of a file in UTF-8, with or without a byte-order mark, its line ends as they are.

    Raises
    ------
    InputError
        As :func:`read_input`, or it is no text in UTF-8.
    """
    try:
        text = read_input(file, most_bytes).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{file}: byte {error.start} is no text in UTF-8; save the file in that encoding"
        ) from None
    if "\0" in text:
        raise InputError(f"{file}: holds zero bytes, which no text has; save it as text in UTF-8")
    return text


def parse_toml(text: str, file: Path) -> dict[str, Any]:
    """Parse the text of a TOML file.

    Raises
    ------
    InputError
        It is no TOML; the message says where.
    """
    try:
        return tomllib.loads(text.replace("\r\n", "\n"))
    except (ValueError, RecursionError) as error:
        # beside its own error: an integer of thousands of digits, and tables within tables without end
        raise InputError(f"{file}: not readable as TOML: {error}; correct it there") from None


def parse_json(text: str, file: Path) -> Any:
    """Parse the text of a JSON file; a key that stands twice in an object is refused.

    Raises
    ------
    InputError
        It is no JSON; the message says where.
    """
    try:
        return json.loads(text, object_pairs_hook=_without_doubles)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file}: not readable as JSON: {error}; restore it from a copy") from None


def parse_number(text: str) -> float:
    """Return the number that a text is: decimal, or nan, or inf, in ASCII, without the underscores of a program.

    Raises
    ------
    ValueError
        It is none, or larger than :data:`LARGEST_NUMBER` and not infinite.
    """
    if not _DECIMAL.fullmatch(text):
        raise ValueError(f"{text[:40]!r} is no decimal number")
    value = float(text)
    if abs(value) > LARGEST_NUMBER and "n" not in text.lower():
        raise ValueError(f"{text[:40]!r} is larger than any quantity")
    return value


def is_number(value: object) -> TypeGuard[int | float]:
    """Tell whether a value of a TOML or JSON file is a number that a quantity can have."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST_NUMBER


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key {next(key for key in keys if keys.count(key) > 1)!r} stands there twice")
    return found


def _kind(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "folder"
    return "pipe, a socket or a device"
