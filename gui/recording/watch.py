"""Tells the operator of a problem of the recording as soon as it is known, once for each kind of problem."""

import re
from pathlib import Path

from PySide6.QtCore import QObject

from gui.context import Context
from gui.messages import problem_told
from gui.rig.state import RigState

_NUMBER = re.compile(r"\d+")


class RecordingWatch(QObject):
    """Listens to the state of the rig; a number that grows is no new problem."""

    def __init__(self, context: Context, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._context = context
        self._session: Path | None = None
        self._told: set[str] = set()
        context.link.state_changed.connect(self._look)

    def _look(self, state: RigState) -> None:
        if state.session is None:
            return
        if state.session != self._session:
            self._session, self._told = state.session, set()
        for problem in state.problems:
            if (kind := _NUMBER.sub("", problem)) not in self._told:
                self._told.add(kind)
                self._context.navigator.tell(problem_told(problem))
