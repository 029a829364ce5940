"""The main window: what is always visible around the pages, the way between them, and closing."""

from collections.abc import Sequence
from typing import TypeVar

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QCloseEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QApplication,
    QHBoxLayout,
    QListWidget,
    QMainWindow,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from daq.acquisition.failures import Failure
from daq.acquisition.messages import Telemetry
from gui.context import Context
from gui.messages import Message, failure_told
from gui.recording.watch import RecordingWatch
from gui.rig.disk import DiskWatch
from gui.rig.state import RigState
from gui.stop_key import StopKey
from gui.theme import DARK, LIGHT, apply_theme, theme_of
from gui.widgets.cards import button, scrolled
from gui.widgets.message_bar import Answer, MessageBar
from gui.widgets.rig.rig_bar import RigBar

P = TypeVar("P", bound=QWidget)

STOPPED = "the operator has pressed the software stop"
_QUESTION = Message(
    "warning",
    "A session is being recorded. Close nevertheless?",
    "Until you answer, it goes on.",
    "Closing holds the robot and seals what was recorded.",
)


class Window(QMainWindow):
    """Shows pages beside their names, and below the bar of the rig.

    ``ended`` is emitted once it is closed and all recordings are sealed.

    Parameters
    ----------
    pages : each with a class attribute ``title``
    """

    ended = Signal()

    def __init__(self, context: Context, pages: Sequence[QWidget], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._context = context
        self._closing = self._may_close = False
        self.pages = {str(page.title): page for page in pages}  # type: ignore[attr-defined] # what makes it a page
        self.setWindowTitle(f"Retraction: {context.rig.name}")
        self.rig_bar = RigBar(context.rig.limits)
        self.messages = MessageBar()
        self.navigation = QListWidget()
        self._stack = QStackedWidget()
        self._recording_watch = RecordingWatch(context, self)
        self._disk = DiskWatch(context.sessions_folder, self)
        self._theme_button = button("", "flat")
        self._lay_out()
        self._wire()
        self.show_page(next(iter(self.pages)))
        self._show_state(context.link.state)

    def show_page(self, title: str) -> None:
        """Bring a page to the front."""
        self.navigation.setCurrentRow(list(self.pages).index(title))

    def page(self, kind: type[P]) -> P:
        """Return the page of a class."""
        return next(page for page in self.pages.values() if isinstance(page, kind))

    def stop(self) -> None:
        """Software stop: hold the robot."""
        if self._context.link.state.connected:
            self._context.link.hold(STOPPED)

    def set_dark(self, dark: bool) -> None:
        """Show the application light or dark."""
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        apply_theme(application, DARK if dark else LIGHT)
        self._name_theme_button()

    def close_down(self) -> None:
        """Hold the robot, seal what is recorded, let go of the devices and close; asks nothing."""
        if not self._closing:
            self._closing = True
            self._context.link.close()

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ask while a session runs; hold, seal and let go before the window really closes."""
        if self._may_close:
            event.accept()
            self.ended.emit()
            return
        event.ignore()
        if self._closing:
            return
        if self._context.link.state.session is not None:
            answers = (
                Answer("Hold the robot, seal, and close", self.close_down, "stop"),
                Answer("Go on recording", lambda: None),
            )
            self.messages.ask(_QUESTION, answers)
        else:
            self.close_down()

    def _lay_out(self) -> None:
        self.navigation.setProperty("role", "navigation")
        self.navigation.setAccessibleName("pages")
        self.navigation.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        for number, (title, page) in enumerate(self.pages.items(), start=1):
            self.navigation.addItem(title)
            self.navigation.item(number - 1).setToolTip(f"Ctrl+{number}")
            # on a small or much enlarged screen a page scrolls before the window outgrows it
            self._stack.addWidget(scrolled(page))
        wide = self.navigation.fontMetrics().horizontalAdvance("M" * 11)
        side = QWidget()
        side.setFixedWidth(wide)
        side.setProperty("role", "side")
        side.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        column = QVBoxLayout(side)
        column.setContentsMargins(0, 0, 0, 8)
        column.addWidget(self.navigation, stretch=1)
        column.addWidget(self._theme_button)
        body = QHBoxLayout()
        body.setSpacing(0)
        body.addWidget(side)
        right = QVBoxLayout()
        right.setContentsMargins(0, 0, 0, 0)
        right.setSpacing(0)
        right.addWidget(self._stack, stretch=1)
        foot = QVBoxLayout()
        foot.setContentsMargins(16, 0, 16, 10)
        foot.addWidget(self.messages)
        right.addLayout(foot)
        body.addLayout(right, stretch=1)
        central = QWidget()
        outer = QVBoxLayout(central)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(0)
        outer.addWidget(self.rig_bar)
        outer.addLayout(body, stretch=1)
        self.setCentralWidget(central)
        self.resize(1440, 900)
        self._name_theme_button()

    def _wire(self) -> None:
        link, navigator = self._context.link, self._context.navigator
        self.navigation.currentRowChanged.connect(self._stack.setCurrentIndex)
        for number in range(1, len(self.pages) + 1):
            shortcut = QShortcut(QKeySequence(f"Ctrl+{number}"), self)
            shortcut.activated.connect(lambda row=number - 1: self.navigation.setCurrentRow(row))
        link.state_changed.connect(self._show_state)
        link.telemetry.connect(self._on_telemetry)
        link.opened.connect(lambda _: self.rig_bar.set_limits(link.rig.limits))
        link.refused.connect(self._on_refused)
        link.closed.connect(self._on_closed)
        self._disk.minutes_left.connect(self.rig_bar.show_disk)
        self.rig_bar.stop_pressed.connect(self.stop)
        self.rig_bar.release_pressed.connect(link.release)
        self._theme_button.clicked.connect(lambda: self.set_dark(not theme_of(self).dark))
        navigator.message_told.connect(self.messages.show_message)
        for signal, title in (
            (navigator.estimate_requested, "Estimate"),
            (navigator.diagnose_requested, "Diagnose"),
            (navigator.replay_requested, "Sessions"),
            (navigator.trial_requested, "Acquire"),
        ):
            if title in self.pages:
                signal.connect(lambda _, title=title: self.show_page(title))
        application = QApplication.instance()
        assert isinstance(application, QObject)
        self._stop_key = StopKey(
            lambda: link.state.connected, lambda: link.state.session is not None, self.stop, self
        )
        application.installEventFilter(self._stop_key)

    def _show_state(self, state: RigState) -> None:
        self.rig_bar.show_state(state)

    def _on_telemetry(self, seen: Telemetry) -> None:
        self._disk.take(seen, self._context.link.state)

    def _on_refused(self, failure: Failure) -> None:
        self.messages.show_message(failure_told(failure))

    def _on_closed(self) -> None:
        if self._closing:
            self._may_close = True
            self.close()

    def _name_theme_button(self) -> None:
        self._theme_button.setText("Light" if theme_of(self).dark else "Dark")
