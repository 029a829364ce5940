"""Which files of a session a living process still works on: locks that end with it, however it ends.

The recorder locks what it writes into, a session its rig file from before the first sample until it is sealed. Where
the system has no such locks (Windows), nothing is ever said to be in use.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from daq.errors import RecordingError

if sys.platform != "win32":
    import fcntl


def lock(file: IO[bytes]) -> None:
    """Lock an open file until it is closed; wait for whoever has locked it."""
    if sys.platform != "win32":
        fcntl.flock(file, fcntl.LOCK_EX)


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Keep a file locked meanwhile."""
    with path.open("r+b") as file:
        lock(file)
        yield


def is_in_use(path: Path) -> bool:
    """Tell whether a living process has locked a file; raises OSError where there is none."""
    if sys.platform == "win32":
        return False
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def require_unused(path: Path) -> None:
    """Refuse a file of a session that a living process still works on.

    Raises
    ------
    RecordingError
        It is being recorded, or sealed.
    """
    if is_in_use(path):
        raise RecordingError(f"{path}: is being recorded; wait until that session has ended")
