"""What may stand in the place of a file: nothing, a folder, a link in a circle, a pipe, a device without end."""

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

Place: TypeAlias = Callable[[Path], None]
"""Puts something else in the place of a file."""

_LARGE_BYTES = 20_000_000_000


def missing(file: Path) -> None:
    """Nothing is there."""
    file.unlink()


def folder(file: Path) -> None:
    """A folder is there."""
    file.unlink()
    file.mkdir()


def circular_link(file: Path) -> None:
    """A link to itself."""
    file.unlink()
    file.symlink_to(file)


def dangling_link(file: Path) -> None:
    """A link to nothing."""
    file.unlink()
    file.symlink_to(file.with_name("nothing"))


def pipe(file: Path) -> None:
    """A pipe that nobody writes to."""
    file.unlink()
    if sys.platform != "win32":
        os.mkfifo(file)


def endless_device(file: Path) -> None:
    """A device that never ends."""
    file.unlink()
    file.symlink_to("/dev/zero")


def unreadable(file: Path) -> None:
    """A file that may not be read; an administrator may all the same."""
    file.chmod(0)


def enormous(file: Path) -> None:
    """Twenty gigabytes, which take no room on the disk."""
    with file.open("r+b") as stream:
        stream.truncate(_LARGE_BYTES)


PLACES: Sequence[Place] = (
    missing,
    folder,
    circular_link,
    dangling_link,
    pipe,
    endless_device,
    unreadable,
    enormous,
)
