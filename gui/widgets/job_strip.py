"""What a job is doing, how far it is, and the button that ends it."""

from collections.abc import Callable

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QProgressBar, QWidget

from gui.jobs.running import Job
from gui.messages import Message
from gui.widgets.cards import button, label

WAIT = "Wait until it has ended, or cancel it, and do it again."
"""What to do where a page can compute only one thing at a time."""


def failed(what: str, line: str) -> Message:
    """Return what to tell where ``what`` did not come about for the reason of ``line``."""
    return Message("error", f"{what}: {line}", "What was recorded is as it was.")


class JobStrip(QWidget):
    """One line; hidden while nothing is being computed.

    Parameters
    ----------
    tell : shows a message to the operator

    Signals
    -------
    idle_changed : a job is watched, or has ended
    """

    idle_changed = Signal()

    def __init__(self, tell: Callable[[Message], None], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._tell = tell
        self._job: Job | None = None
        self._text = label("", "muted")
        self._text.setWordWrap(False)
        self._bar = QProgressBar()
        self._bar.setTextVisible(False)
        self._bar.setMaximumWidth(220)
        self.cancel = button("Cancel", tip="End this computation; nothing that was recorded is touched")
        self.cancel.clicked.connect(self._cancel)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._text, 1)
        layout.addWidget(self._bar)
        layout.addWidget(self.cancel)
        self.hide()

    @property
    def idle(self) -> bool:
        """Whether nothing is being computed."""
        return self._job is None

    def watch(self, job: Job, failure: str) -> None:
        """Show a job until it ends; where it fails, ``failure`` says what there is not."""
        self._job = job
        self._progress(job.title, 0, 0)
        self.cancel.setEnabled(True)
        job.progressed.connect(self._progress)
        job.failed.connect(lambda line: self._tell(failed(failure, line)))
        job.ended.connect(self._end)
        self.show()
        self.idle_changed.emit()

    def _progress(self, text: str, done: int, total: int) -> None:
        counted = total > 1
        self._text.setText(f"{text}, {done} of {total}" if counted else text)
        self._bar.setRange(0, total if counted else 0)
        self._bar.setValue(done)

    def _cancel(self) -> None:
        if self._job is not None:
            self._job.cancel()
            self.cancel.setEnabled(False)
            self._progress("ending", 0, 0)

    def _end(self) -> None:
        self._job = None
        self.hide()
        self.idle_changed.emit()
