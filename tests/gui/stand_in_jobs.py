"""Jobs that run nowhere: a test looks at what was asked for, and says what comes back."""

from dataclasses import replace

from PySide6.QtCore import QObject, Signal

from gui.context import Context


class StandInJob(QObject):
    """Has the signals of a job; the test emits them."""

    progressed = Signal(str, int, int)
    shown = Signal(object)
    finished = Signal(object)
    failed = Signal(str)
    cancelled = Signal()
    ended = Signal()

    def __init__(self, title: str, task: object, arguments: tuple[object, ...]) -> None:
        super().__init__()
        self.title, self.task, self.arguments = title, task, arguments
        self.cancel_asked = False

    def cancel(self) -> None:
        self.cancel_asked = True

    def finish(self, result: object) -> None:
        self.finished.emit(result)
        self.ended.emit()

    def fail(self, line: str) -> None:
        self.failed.emit(line)
        self.ended.emit()


class StandInJobs(QObject):
    """Keeps what was asked for."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[StandInJob] = []
        self.prepared = False

    def prepare(self) -> None:
        self.prepared = True

    def start(self, title: str, task: object, *arguments: object) -> StandInJob:
        self.asked.append(StandInJob(title, task, arguments))
        return self.asked[-1]


def without_processes(context: Context) -> tuple[Context, StandInJobs]:
    """The same context, whose jobs are left to the test."""
    jobs = StandInJobs()
    return replace(context, jobs=jobs), jobs  # type: ignore[arg-type]  # it has what a page asks of jobs
