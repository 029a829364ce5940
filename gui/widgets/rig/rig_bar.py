"""What is always visible: the rig's state in words, recording, force against its limit, disk, problems, the stop."""

import math

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from daq.limits import Limits
from gui.rig.state import RigState
from gui.widgets.cards import button, set_role
from gui.widgets.lamp import Lamp
from gui.widgets.rig.limit_bar import LimitBar

STOP_KEYS = "Esc, Pause"
_FEW_MINUTES = 10.0
_PROBLEMS_PX = 240


class RigBar(QFrame):
    """Renders a :class:`gui.rig.state.RigState`; ``stop_pressed`` and ``release_pressed`` are its two buttons.

    Attributes
    ----------
    problems : label with what the recording is marked with
    """

    stop_pressed = Signal()
    release_pressed = Signal()

    def __init__(self, limits: Limits, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "bar")
        self._lamp = Lamp()
        self._words = _line("figure")
        self._words.setTextFormat(Qt.TextFormat.PlainText)
        self._recording = _line("muted")
        self._force = LimitBar("force", "N", limits.force_n)
        self._torque = LimitBar("torque", "N·m", limits.torque_nm)
        self._disk = _line("muted")
        self.problems = _line("muted")
        self.problems.setTextFormat(Qt.TextFormat.PlainText)
        self.stop = button(
            f"■  STOP\n{STOP_KEYS}",
            "stop",
            "Holds the robot. No emergency stop: that is the button on the wire.",
        )
        self.stop.setAccessibleName("software stop")
        self.stop.clicked.connect(self.stop_pressed)
        self.release = button(
            "Release", tip="Lets the robot move again, after a look at the cell. Nothing moves by itself."
        )
        self.release.clicked.connect(self.release_pressed)
        state = QVBoxLayout()
        state.setSpacing(1)
        state.addWidget(self._words)
        state.addWidget(self._recording)
        loads = QVBoxLayout()
        loads.addWidget(self._force)
        loads.addWidget(self._torque)
        numbers = QVBoxLayout()
        numbers.addWidget(self._disk)
        numbers.addWidget(self.problems)
        row = QHBoxLayout(self)
        row.setContentsMargins(16, 10, 16, 10)
        row.setSpacing(14)
        row.addWidget(self._lamp)
        row.addLayout(state, stretch=1)
        row.addLayout(loads)
        row.addLayout(numbers)
        row.addWidget(self.release)
        row.addWidget(self.stop)
        self.show_disk(math.nan)

    def set_limits(self, limits: Limits) -> None:
        """Take the limits of another rig."""
        self._force.set_limit(limits.force_n)
        self._torque.set_limit(limits.torque_nm)

    def show_state(self, state: RigState) -> None:
        """Show a state."""
        recording = state.session is not None
        self._lamp.show_health("bad" if state.phase == "held" else "good" if state.connected else "off")
        metrics = self._words.fontMetrics()
        shown = metrics.elidedText(state.words, Qt.TextElideMode.ElideRight, max(120, self._words.width()))
        self._words.setText(shown)
        self._words.setToolTip(state.words)
        minutes, seconds = divmod(int(state.recording_s), 60)
        self._recording.setText(
            f"● recording {minutes:02d}:{seconds:02d} min, step {state.step} of {state.steps}"
            if recording
            else "○ not recording"
        )
        set_role(self._recording, "bad" if recording else "muted")
        unzeroed = "" if state.zero is not None else "not zeroed: take a tare"
        self._force.show_value(state.force_n, unzeroed)
        self._torque.show_value(state.torque_nm, unzeroed)
        flawless = "no problem so far" if recording else ""
        told = f"⚠ {'; '.join(state.problems)}" if state.problems else flawless
        self.problems.setText(
            self.problems.fontMetrics().elidedText(told, Qt.TextElideMode.ElideRight, _PROBLEMS_PX)
        )
        self.problems.setToolTip("\n".join(state.problems))
        set_role(self.problems, "bad" if state.problems else "muted")
        self.stop.setEnabled(state.connected)
        self.release.setVisible(state.phase == "held")

    def show_disk(self, minutes: float) -> None:
        """Show how long may still be recorded; NaN while that is not known."""
        self._disk.setText(
            "disk –" if math.isnan(minutes) else f"disk {minutes:,.0f} min left".replace(",", "\u2009")
        )
        set_role(self._disk, "bad" if minutes < _FEW_MINUTES else "muted")


def _line(role: str) -> QLabel:
    made = QLabel()
    made.setProperty("role", role)
    return made
