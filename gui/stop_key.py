"""The keys of the software stop, heard whatever page or dialog has the focus."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent


class StopKey(QObject):
    """An event filter for the whole application.

    ``Pause`` stops whenever devices are connected. ``Esc`` stops while a session runs, and has its usual meaning, such
    as to leave a dialog, while nothing can move.

    Parameters
    ----------
    connected, moving : ask the present state
    stop : holds the robot
    """

    def __init__(
        self,
        connected: Callable[[], bool],
        moving: Callable[[], bool],
        stop: Callable[[], None],
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._connected, self._moving, self._stop = connected, moving, stop

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the key of a stop away from whoever has the focus."""
        if event.type() != QEvent.Type.KeyPress or not isinstance(event, QKeyEvent):
            return False
        wanted = (event.key() == Qt.Key.Key_Pause and self._connected()) or (
            event.key() == Qt.Key.Key_Escape and self._moving()
        )
        if wanted and not event.isAutoRepeat():
            self._stop()
        return wanted
