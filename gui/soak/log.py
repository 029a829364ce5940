"""The seconds of a soak in a CSV file that has each of them as soon as it was measured."""

import csv
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gui.soak.meter import Second
from robot_drivers.closing import ClosedAtExit


class SoakLog(ClosedAtExit):
    """Writes seconds from construction to :meth:`close`; a context manager.

    Attributes
    ----------
    seconds : so far
    """

    def __init__(self, path: Path) -> None:
        self.seconds: list[Second] = []
        self._file = path.open("x", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file)

    def add(self, second: Second) -> None:
        """Write a second, which is then safe from the end of this process."""
        row = _row(second)
        if not self.seconds:
            self._writer.writerow(row)
        self._writer.writerow(row.values())
        self._file.flush()
        self.seconds.append(second)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _row(second: Second) -> dict[str, Any]:
    """Return the columns; those of the processes bear their names."""
    plain = asdict(second)
    held = {
        f"{process}_{name}": value
        for process in ("window", "recorder")
        for name, value in plain.pop(process).items()
    }
    received = {f"received_{stream}": count for stream, count in sorted(plain.pop("received").items())}
    return {**plain, **held, "images": sum(plain["images"].values()), **received}
