"""``python -m gui``: the operator's window, over a rig file or over the emulated laboratory."""

import argparse
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QApplication

from daq.errors import DaqError
from daq.rig import Rig, read_rig
from gui.collector import Collector
from gui.context import Context, Navigator
from gui.jobs.running import Jobs
from gui.messages import Message
from gui.opening import STARTING, Opening
from gui.pages.acquire import AcquirePage
from gui.pages.calibrate import CalibratePage
from gui.pages.diagnose import DiagnosePage
from gui.pages.estimate import EstimatePage
from gui.pages.rig import RigPage
from gui.pages.sessions import SessionsPage
from gui.rig.laboratory import CALIBRATIONS_FOLDER, Laboratory, roles
from gui.rig.link import AcquisitionLink
from gui.rig.virtual_laboratory import run_emulators
from gui.theme import DARK, LIGHT, apply_theme, system_theme
from gui.window import Window
from robot_drivers.real_time import prefer_this_process, shorten_collections

_SIGNAL_LOOK_MS = 200


class Desk(QObject):
    """What there is while a window is: the laboratory, the link, the jobs; all of them end with the window.

    Parameters
    ----------
    own : the rig of the rig file, None for the emulated laboratory alone

    Attributes
    ----------
    window : None until the rig is known
    window_ready : the window is there, and the devices of an emulated laboratory are being connected
    failed : str, the emulated laboratory could not be started
    ended : everything has ended
    """

    window_ready = Signal(object)
    failed = Signal(str)
    ended = Signal()

    def __init__(self, own: Rig | None, sessions_folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._sessions_folder = sessions_folder
        self._collector = Collector(self)
        self.window: Window | None = None
        self.context: Context | None = None
        self.laboratory = Laboratory(own, run_emulators, sessions_folder / CALIBRATIONS_FOLDER, self)
        self.laboratory.failed.connect(self.failed)

    def open(self) -> None:
        """Show the window over the rig file."""
        assert self.laboratory.own is not None
        self._build(self.laboratory.own)

    def open_virtual(self) -> None:
        """Start the emulated laboratory, then show the window and connect."""
        own = self.laboratory.own
        self.laboratory.prepared.connect(self._on_virtual, Qt.ConnectionType.SingleShotConnection)
        self.laboratory.prepare(frozenset() if own is None else frozenset(roles(own)))

    def end(self) -> None:
        """End everything; waits for what is still being sealed."""
        if self.context is not None:
            self.context.jobs.close()
            self.context.link.end()
        self.laboratory.end()
        self._collector.end()
        self.ended.emit()

    def _on_virtual(self, rig: Rig) -> None:
        self._build(rig)
        assert self.context is not None
        self.context.link.open(rig)

    def _build(self, rig: Rig) -> None:
        context = self.context = Context(
            rig, self._sessions_folder, AcquisitionLink(rig, self), Jobs(self), Navigator(self)
        )
        pages = (
            RigPage(context, self.laboratory),
            CalibratePage(context, self.laboratory),
            AcquirePage(context),
            EstimatePage(context),
            DiagnosePage(context),
            SessionsPage(context),
        )
        self.window = Window(context, pages)
        self.laboratory.warned.connect(lambda words: _on_warned(context, words))
        self.window.ended.connect(self.end)
        self.window.show()
        self.window_ready.emit(self.window)


def _on_warned(context: Context, words: str) -> None:
    """Tell what went wrong in the emulated laboratory, and mark what is being recorded with it."""
    context.navigator.tell(Message("warning", f"{words[:1].upper()}{words[1:]}."))
    if context.link.state.session is not None:
        context.link.mark(words)


def main(arguments: Sequence[str] | None = None) -> int:
    """Show the window until it is closed; returns the exit status."""
    parser = argparse.ArgumentParser(prog="retract gui", description=main.__doc__)
    parser.add_argument("rig", metavar="RIG", nargs="?", help="rig file (default: asks)")
    parser.add_argument("--virtual", action="store_true", help="every device emulated")
    parser.add_argument(
        "--sessions",
        type=Path,
        default=Path("sessions"),
        metavar="DIR",
        help="of the recordings (default: %(default)s)",
    )
    parser.add_argument("--theme", choices=("light", "dark"), help="(default: as the desktop)")
    options = parser.parse_args(arguments)
    try:
        own = None if options.rig is None else read_rig(Path(options.rig))
    except DaqError as error:
        sys.stderr.write(f"retract gui: {error}\n")
        return 2
    QApplication.setAttribute(Qt.ApplicationAttribute.AA_DontUseNativeDialogs)
    # who shows that somebody watches must not wait for computations
    prefer_this_process()
    application = QApplication(sys.argv[:1])
    application.setApplicationName("Retraction")
    apply_theme(application, {"light": LIGHT, "dark": DARK}.get(options.theme) or system_theme())
    application.setQuitOnLastWindowClosed(False)
    stage = _Stage(options.sessions, application)
    stage.begin(own, options.virtual)
    return application.exec()


class _Stage(QObject):
    """The way from the opening to the window, and to the end of the program."""

    def __init__(self, sessions_folder: Path, application: QApplication) -> None:
        super().__init__(application)
        self._application = application
        self._sessions_folder = sessions_folder
        self._desk: Desk | None = None
        self.opening = Opening()
        self.opening.virtual_wanted.connect(lambda: self._open(None, virtual=True))
        self.opening.rig_read.connect(lambda rig: self._open(rig, virtual=False))
        self.opening.setAttribute(Qt.WidgetAttribute.WA_QuitOnClose, False)
        signal.signal(signal.SIGINT, lambda *_: self._close())
        for name in ("SIGTERM", "SIGHUP"):
            if (number := getattr(signal, name, None)) is not None:  # Windows has no SIGHUP
                signal.signal(number, lambda *_: self._close(ask=False))
        # Python hears signals only while it runs
        self._ear = QTimer(self, interval=_SIGNAL_LOOK_MS)
        self._ear.timeout.connect(self._look)
        self._ear.start()

    def begin(self, own: Rig | None, virtual: bool) -> None:
        """Open what the command line names, else ask."""
        if own is not None and not virtual:
            self._open(own, virtual=False)
            return
        self.opening.show()
        if virtual:
            self.opening.wait(STARTING)
            self._open(own, virtual=True)

    def _open(self, own: Rig | None, *, virtual: bool) -> None:
        if self._desk is not None:
            self._desk.end()
        desk = self._desk = Desk(own, self._sessions_folder, self)
        desk.window_ready.connect(lambda _: self.opening.hide())
        desk.window_ready.connect(lambda _: shorten_collections())
        desk.failed.connect(self.opening.show_failure)
        if virtual:
            desk.open_virtual()
        else:
            desk.open()
        desk.ended.connect(self._application.quit)

    def _close(self, *, ask: bool = True) -> None:
        """Close the window; who asks nothing holds the robot and seals where a session runs."""
        window = None if self._desk is None else self._desk.window
        if window is not None and ask:
            window.close()
        elif window is not None:
            window.close_down()
        else:
            self.opening.close()

    def _look(self) -> None:
        """End the program when the opening was closed without a choice."""
        if not self.opening.isVisible() and (self._desk is None or self._desk.window is None):
            if self._desk is not None:
                self._desk.end()
            self._application.quit()


if __name__ == "__main__":
    sys.exit(main())
