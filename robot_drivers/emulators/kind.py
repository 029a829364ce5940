"""What it takes to start an emulator by name."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Running:
    """An emulator that listens: where, in one line, and what it has to report at the moment (empty for nothing)."""

    where: str
    report: Callable[[], str] = field(default=lambda: "")


@dataclass(frozen=True, slots=True)
class EmulatorKind:
    """One kind of emulator.

    Attributes
    ----------
    summary : what it emulates
    options : title and dataclass of its options; none of their fields may have the name of another's
    start : makes it from instances of these dataclasses, in their order
    flags : options named otherwise than their fields
    example : options that show something
    """

    summary: str
    options: Mapping[str, type[Any]]
    start: Callable[..., AbstractContextManager[Running]]
    flags: Mapping[str, str] = field(default_factory=dict)
    example: str = ""
