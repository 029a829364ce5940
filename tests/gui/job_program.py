"""A window's program with a job that never ends; writes the numbers of its processes."""

import sys
from pathlib import Path

from job_tasks import clear_up_when_interrupted
from PySide6.QtCore import QCoreApplication

from gui.jobs import Jobs


def main() -> None:
    application = QCoreApplication(sys.argv[:1])
    jobs = Jobs()
    job = jobs.start("for ever", clear_up_when_interrupted, Path(sys.argv[1]))
    job.shown.connect(lambda pids: (sys.stdout.write(f"{pids[0]} {pids[1]}\n"), sys.stdout.flush()))
    application.exec()


if __name__ == "__main__":
    main()
