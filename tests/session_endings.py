"""How a session ended, as its folder tells."""

import time
from pathlib import Path

from daq.recording.folder import read_info
from daq.recording.reader import Recording


def wait_until_sealed(folder: Path, timeout_s: float = 60.0) -> None:
    deadline = time.monotonic() + timeout_s
    # The checksums are there a moment before the description that says so.
    while not (folder / "CHECKSUMS.sha256").is_file() or read_info(folder).state == "recording":
        assert time.monotonic() < deadline, "the session was never sealed"
        time.sleep(0.05)


def stop_of(folder: Path) -> tuple[str, float]:
    """Why and when, on the host clock in s, the guard held the robot."""
    (failed,) = [event for event in Recording(folder).events if event.name == "session_failed"]
    guard = failed.details["guard"]
    return guard["reason"], guard["cause_time_ns"] * 1e-9 + guard["standstill_s"]
