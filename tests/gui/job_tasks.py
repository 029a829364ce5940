"""What the tests of jobs have done in other processes."""

import os
import time
from collections.abc import Callable
from pathlib import Path

from daq.errors import RecordingError
from estimator.workers import worker_pool
from gui.jobs.process import Reporter


def count(report: Reporter, most: int) -> int:
    for number in range(1, most + 1):
        report("counting", number, most)
        report.show(number * number)
    return most


def fail(report: Reporter) -> None:
    raise RecordingError("sessions/one: is being recorded;\n  wait")


def break_down(report: Reporter) -> None:
    raise ZeroDivisionError


def wait_for_file(report: Reporter, path: Path) -> str:
    report("waiting", 0, 1)
    while not path.exists():
        time.sleep(0.01)
    return "seen"


def clear_up_when_interrupted(report: Reporter, path: Path) -> None:
    """Work in a worker of its own for ever; leave a file behind when interrupted."""
    with worker_pool(1) as pool:
        worker = pool.submit(os.getpid).result()
        pool.submit(time.sleep, 3600.0)
        report.show((os.getpid(), worker))
        try:
            time.sleep(3600.0)
        except KeyboardInterrupt:
            path.touch()
            raise


def ended(process_id: int) -> Callable[[], bool]:
    """Whether a process is gone; one that nobody has waited for yet counts as gone."""

    def look() -> bool:
        try:
            status = Path(f"/proc/{process_id}/stat").read_text(encoding="ascii")
        except OSError:
            return True
        return status.rpartition(")")[2].split()[0] == "Z"

    return look


def tells_its_priority() -> Callable[[object, object], int]:
    """What a companion may be made of: it answers with the niceness of its process."""
    return lambda request, progress: os.getpriority(os.PRIO_PROCESS, 0)
