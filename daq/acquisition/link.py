"""The line on which the acquisition process reports to its client."""

import pickle
import threading
from typing import BinaryIO

from daq.acquisition.messages import Report


class Link:
    """Sends reports, one at a time; a client that is gone is left to those who watch it."""

    def __init__(self, reports: BinaryIO) -> None:
        self._reports = reports
        self._lock = threading.Lock()

    def send(self, report: Report) -> None:
        """Send a report; waits for a client that does not read."""
        data = pickle.dumps(report)
        with self._lock:
            try:
                self._reports.write(data)
                self._reports.flush()
            except (BrokenPipeError, ValueError):
                return
