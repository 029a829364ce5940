"""Carries out the operator's queue, one session after the other, and stops at the first that does not end well."""

from dataclasses import dataclass, replace
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from daq.acquisition.messages import Ended
from daq.errors import DaqError, SoftwareStopError
from daq.plans import NAME_TEMPLATE, Plan, Trial, new_folder, runs
from daq.session.session import Label
from daq.session_report import read_report
from daq.trajectories import Trajectory
from gui.context import Context
from gui.messages import failure_told, information, recorded_told
from gui.recording import work_queue
from gui.recording.work_queue import (
    QUEUE_FILE,
    Queue,
    changed,
    next_place,
    read_queue,
    with_trial,
    write_queue,
)


@dataclass(frozen=True, slots=True)
class Labels:
    """What the operator says about the sessions to come.

    Attributes
    ----------
    operator : who records
    order : of the next experiment on its mounting, from 1
    name : template of the sessions' names; see :mod:`daq.plans`
    """

    operator: str = ""
    order: int = 1
    name: str = NAME_TEMPLATE


class QueueRunner(QObject):
    """Owns the queue; ``queue_changed`` brings every new one, and ``labels_changed`` the labels."""

    queue_changed = Signal(object)
    labels_changed = Signal(object)

    def __init__(self, context: Context, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._context = context
        self._path = context.sessions_folder / QUEUE_FILE
        self.labels = Labels()
        self.queue: Queue = ()
        self.going_on = False
        self._place: int | None = None
        context.link.ended.connect(self._on_ended)
        context.link.refused.connect(self._on_refused)
        context.link.failed.connect(lambda _: self._give_up("the connection was lost"))

    def load(self) -> None:
        """Take up the queue of the sessions' folder; what is wrong with its file is told."""
        try:
            self.set_queue(read_queue(self._path))
        except DaqError as error:
            self._context.navigator.tell(replace(information(str(error)), severity="warning"))

    def set_queue(self, queue: Queue) -> None:
        """Take another queue, and keep it in its file."""
        self.queue = queue
        write_queue(queue, self._path)
        self.queue_changed.emit(queue)

    def set_labels(self, labels: Labels) -> None:
        """Label the sessions to come."""
        if labels != self.labels:
            self.labels = labels
            self.labels_changed.emit(labels)

    def add(self, trial: Trial) -> None:
        """Put a trial at the end of the queue."""
        self.set_queue(with_trial(self.queue, trial))

    @property
    def running(self) -> bool:
        """Whether a session of the queue runs."""
        return self._place is not None

    def run_next(self) -> None:
        """Carry out the first entry that waits, then stop."""
        self.going_on = False
        self._begin()

    def run_all(self) -> None:
        """Carry out all entries that wait, as long as each ends well."""
        self.going_on = True
        self._begin()

    def pause(self) -> None:
        """Stop after the session that runs."""
        self.going_on = False
        self.queue_changed.emit(self.queue)

    def _begin(self) -> None:
        place = next_place(self.queue)
        if place is None or self.running or not self._context.link.state.connected:
            self.going_on = False
            self.queue_changed.emit(self.queue)
            return
        entry = self.queue[place]
        try:
            trajectory = entry.trial.lay_out(self._context.sessions_folder)
            folder = self._folder(entry.trial, place, trajectory)
        except (DaqError, ValueError) as error:
            self.going_on = False
            self.set_queue(changed(self.queue, place, replace(entry, state="failed", remark=str(error))))
            return
        self._place = place
        self.set_queue(changed(self.queue, place, replace(entry, state="running", session=folder, remark="")))
        label = Label(folder.name, self.labels.order, self.labels.operator, entry.trial.notes)
        self._context.link.start(trajectory, folder, label)

    def _folder(self, trial: Trial, place: int, trajectory: Trajectory) -> Path:
        plan = Plan(
            (trial,),
            sessions=self._context.sessions_folder,
            name=self.labels.name,
            operator=self.labels.operator,
        )
        run = replace(runs(plan)[0], number=place + 1, order=self.labels.order)
        return new_folder(plan, self._context.link.rig, run, trajectory)

    def _on_ended(self, ended: Ended) -> None:
        if self._place is None:
            return
        place, self._place = self._place, None
        entry = self.queue[place]
        if ended.failure is not None:
            self.going_on = False
            state: work_queue.EntryState = (
                "stopped" if issubclass(ended.failure.kind, SoftwareStopError) else "failed"
            )
            session = entry.session if ended.info is not None else None
            self.set_queue(
                changed(
                    self.queue,
                    place,
                    replace(entry, state=state, session=session, remark=ended.failure.message),
                )
            )
            self._context.navigator.tell(failure_told(ended.failure))
        else:
            self.set_queue(changed(self.queue, place, replace(entry, state="done")))
            self.set_labels(replace(self.labels, order=self.labels.order + 1))
            problems = ended.info.problems if ended.info is not None else ()
            self._context.navigator.tell(recorded_told(_name(entry.session), problems, _pace(entry.session)))
        if entry.session is not None and ended.info is not None:
            self._context.navigator.session_recorded.emit(entry.session)
        if self.going_on:
            self._begin()

    def _on_refused(self, failure: object) -> None:
        self.going_on = False

    def _give_up(self, why: str) -> None:
        self.going_on = False
        if self._place is not None:
            place, self._place = self._place, None
            self.set_queue(
                changed(self.queue, place, replace(self.queue[place], state="stopped", remark=why))
            )


def _pace(session: Path | None) -> list[str]:
    """Return how much slower than real time an emulated laboratory ran; nothing where that is not known."""
    try:
        return [] if session is None else read_report(session).pace_lines()
    except DaqError:
        return []


def _name(session: Path | None) -> str:
    return "The session" if session is None else session.name
