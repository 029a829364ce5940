"""What a fuzzed parser is: how its inputs are made, and how a wrong value passed as good is told."""

from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

from robot_drivers.errors import DeviceError, DeviceProtocolError


class WrongValueError(Exception):
    """A parser took bytes for something else than they say."""


@dataclass(frozen=True, slots=True)
class Target:
    """One parser.

    Attributes
    ----------
    name : on the command line and in tables
    oracle : one line: by what, independent of the parser, its results are judged
    generate : makes an input
    check : parses it; True where it was taken for good, False where only a part was. Raises WrongValueError for a
        wrong value, and one of ``errors`` where the parser refused the input
    errors : what the parser says that it raises
    """

    name: str
    oracle: str
    generate: Callable[[Random], Any]
    check: Callable[[Any], bool]
    errors: tuple[type[DeviceError], ...] = (DeviceProtocolError,)


def agree(parsed: object, expected: object, what: str) -> None:
    """Raise WrongValueError where a parser and its judge differ."""
    if parsed != expected:
        raise WrongValueError(f"{what}: parsed as {parsed!r}, the bytes say {expected!r}")
