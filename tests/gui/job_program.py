"""A window's program with one job: one that never ends, whose processes' numbers it writes, or one that breaks down."""

import sys
from pathlib import Path

from job_tasks import break_down, clear_up_when_interrupted
from PySide6.QtCore import QCoreApplication

from gui.jobs.running import Jobs


def main() -> None:
    application = QCoreApplication(sys.argv[:1])
    jobs = Jobs()
    if len(sys.argv) > 1:
        job = jobs.start("for ever", clear_up_when_interrupted, Path(sys.argv[1]))
        job.shown.connect(lambda pids: say(f"{pids[0]} {pids[1]}"))
    else:
        job = jobs.start("dividing", break_down)
        job.failed.connect(say)
        job.ended.connect(application.quit)
    application.exec()


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
