"""The sessions of a folder, found beside the interface thread: on a slow disk a long list takes seconds to read."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from gui.jobs.background import Background
from gui.sessions.session_list import entry_of, find_sessions


class SessionFinder(QObject):
    """Looks for sessions whenever it is asked.

    Signals
    -------
    found : tuple of SessionEntry, the newest first
    failed : why the folder cannot be read, in one line
    """

    found = Signal(object)
    failed = Signal(str)

    def __init__(self, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.folder = folder.absolute()
        self._background = Background(self)

    def look(self, elsewhere: Sequence[Path] = ()) -> None:
        """Look for the sessions, behind some from other folders; ``found`` or ``failed`` follows."""
        self._background.do(
            lambda: (*map(entry_of, elsewhere), *find_sessions(self.folder)), self.found.emit, self._fail
        )

    def _fail(self, error: Exception) -> None:
        self.failed.emit(str(error))
