"""Finds the beads in live images beside the window, as often as it can and never faster than it is looked at."""

from collections.abc import Mapping

from PySide6.QtCore import QObject, QTimer, Signal

from daq.acquisition.messages import Seen
from gui.jobs.companion import Companion
from gui.rig.bead_marks import BeadView, BeadViewer
from gui.rig.link import AcquisitionLink
from robot_drivers.protocols import DeviceIdentity

_PERIOD_MS = 400


class BeadFinder(QObject):
    """Asks the link for images of one moment, has them looked at in another process, and asks for the next ones.

    ``found`` brings a :class:`gui.rig.bead_marks.BeadView`. Nothing is asked for unless ``watch`` was called.
    """

    found = Signal(object)

    def __init__(self, link: AcquisitionLink, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._link = link
        self._viewer: Companion | None = None
        self._watching = self._asked = self._busy = False
        self._timer = QTimer(self, interval=_PERIOD_MS)
        self._timer.timeout.connect(self._ask)
        self._serials: dict[str, str] = {}
        link.opened.connect(self._on_opened)
        link.closed.connect(self._end)
        link.failed.connect(self._end)
        link.seen.connect(self._send)

    def watch(self, watching: bool) -> None:
        """Look from now on, or no longer; the process is started when it is first needed."""
        self._watching = watching
        if watching and self._viewer is None and self._link.state.connected:
            self._begin()

    def renew(self) -> None:
        """Look with what is in force now, from the next image on."""
        self._end()

    def _on_opened(self, devices: Mapping[str, DeviceIdentity]) -> None:
        self._end()
        self._serials = {role: identity.serial for role, identity in devices.items()}

    def _begin(self) -> None:
        self._asked = self._busy = False
        self._viewer = Companion(BeadViewer, (self._link.rig, self._serials), self)
        self._viewer.answered.connect(self._take)
        self._viewer.gone.connect(self._end)
        self._timer.start()

    def _end(self) -> None:
        self._timer.stop()
        if self._viewer is not None:
            self._viewer.end()
            self._viewer.deleteLater()
        self._viewer = None

    def _ask(self) -> None:
        if self._watching and self._link.state.connected and not (self._asked or self._busy):
            self._asked = True
            self._link.look()

    def _send(self, seen: Seen) -> None:
        if self._viewer is not None and self._asked:
            self._busy = True
            self._viewer.ask(seen)
        self._asked = False

    def _take(self, view: object) -> None:
        self._busy = False
        if isinstance(view, BeadView):
            self.found.emit(view)
