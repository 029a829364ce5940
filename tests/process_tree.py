"""A program with everything that it starts, found by a mark that all of them inherit: also what has lost its parent."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4

_MARK = "RETRACTION_TEST_TREE"


class ProcessTree:
    """A running program; ``first`` is the process that was started."""

    def __init__(self, first: subprocess.Popen[bytes], mark: str, said: Path) -> None:
        self.first = first
        self._mark = f"{_MARK}={mark}".encode()
        self._said = said

    def said(self) -> str:
        """What it has written to standard output and standard error."""
        return self._said.read_text(encoding="utf-8", errors="replace")

    def members(self) -> dict[int, str]:
        """Command lines of the processes that are there, by their ids; those that only wait to be buried are not."""
        found = {}
        for place in Path("/proc").glob("[0-9]*"):
            try:
                environment = (place / "environ").read_bytes()
                if self._mark in environment.split(b"\0"):
                    found[int(place.name)] = (place / "cmdline").read_bytes().replace(b"\0", b" ").decode()
            except OSError:
                continue  # gone meanwhile
        return found

    def wait_until_gone(self, timeout_s: float) -> None:
        deadline = time.monotonic() + timeout_s
        while left := self.members():
            assert time.monotonic() < deadline, f"still there: {left}\n{self.said()}"
            self.first.poll()
            time.sleep(0.1)

    def wait_until(self, condition: Callable[[], bool], timeout_s: float, what: str) -> None:
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert self.first.poll() is None, f"ended before {what}:\n{self.said()}"
            assert time.monotonic() < deadline, f"no {what}:\n{self.said()}"
            time.sleep(0.05)


@contextmanager
def running(command: list[str], folder: Path) -> Iterator[ProcessTree]:
    """Run ``python -m COMMAND`` in a session of its own; whatever is left of it at the end is killed."""
    mark = uuid4().hex
    said = folder / f"said-{mark}"
    environment = {
        "QT_QPA_PLATFORM": "offscreen",
        **os.environ,
        _MARK: mark,
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
    }
    with said.open("wb") as output:
        first = subprocess.Popen(
            [sys.executable, "-m", *command],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            start_new_session=True,
        )
    tree = ProcessTree(first, mark, said)
    try:
        yield tree
    finally:
        for process in tree.members():
            try:
                os.kill(process, 9)
            except ProcessLookupError:
                continue
        first.wait()
