"""A recorded session played and scrubbed through the widgets that show the live rig."""

import time
from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QSlider, QToolButton, QVBoxLayout, QWidget

from daq.rig import Rig
from gui.jobs.background import Background
from gui.rig.state import RigState
from gui.sessions.playback import Instant, Playback, open_playback
from gui.widgets.cards import label
from gui.widgets.plots.force_plot import SPAN_S, ForcePlot
from gui.widgets.rig.readings import PoseReadings
from gui.widgets.video.camera_preview import CameraPreview

_FRAME_MS = 40
_SPEEDS = (0.5, 1.0, 2.0, 5.0, 10.0)
_TICKS_PER_S = 100


class ReplayPane(QWidget):
    """Opens one session at a time.

    ``opened`` tells that its first instant is there, ``failed`` why a session cannot be played, in one line.

    Parameters
    ----------
    rig : whose limits and frames are used where a session's own rig file cannot be read
    """

    opened = Signal()
    failed = Signal(str)

    def __init__(self, rig: Rig, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._usual_rig = rig
        self._playback: Playback | None = None
        self._background = Background(self)
        self._waiting = False
        self.force = ForcePlot(rig.limits)
        self.preview = CameraPreview([camera.name for camera in rig.cameras])
        self.pose = PoseReadings()
        self.words = label("open a session to replay it", "muted")
        self.words.setWordWrap(False)
        self.play = QToolButton()
        self.play.setText("▶")
        self.play.setCheckable(True)
        self.play.setToolTip("Play")
        self.play.toggled.connect(self._play)
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setAccessibleName("Instant of the session")
        self.slider.valueChanged.connect(self._show)
        self.speed = QComboBox()
        self.speed.setAccessibleName("Speed of the replay")
        for speed in _SPEEDS:
            self.speed.addItem(f"{speed:g} ×", speed)
        self.speed.setCurrentIndex(_SPEEDS.index(1.0))
        self.clock = QLabel("")
        self._timer = QTimer(self, interval=_FRAME_MS)
        self._timer.timeout.connect(self._advance)
        self._last_s = 0.0
        self._lay_out()
        self._enable(False)

    def open(self, session: Path) -> None:
        """Read a session beside the window; ``opened`` or ``failed`` follows."""
        self.close_session()
        self.words.setText(f"opening {session.name}")
        self._background.do(lambda: open_playback(session), self._begin, self._fail)

    def close_session(self) -> None:
        """Show nothing."""
        self.play.setChecked(False)
        self._playback = None
        self._enable(False)
        self.force.clear()
        self.preview.clear()
        self.words.setText("open a session to replay it")
        self.clock.setText("")

    def end(self) -> None:
        """End the thread that reads, at the end of the program."""
        self._timer.stop()
        self._background.end()

    def seek(self, position_s: float) -> None:
        """Go to so many seconds after the first sample."""
        self.slider.setValue(round(position_s * _TICKS_PER_S))

    def _lay_out(self) -> None:
        below = QHBoxLayout()
        below.addWidget(self.play)
        below.addWidget(self.slider, 1)
        below.addWidget(self.clock)
        below.addWidget(self.speed)
        told = QHBoxLayout()
        told.addWidget(self.words, 1)
        told.addWidget(self.pose, 2)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 8, 0, 0)
        layout.addWidget(self.preview, 3)
        layout.addLayout(told)
        layout.addWidget(self.force, 4)
        layout.addLayout(below)

    def _begin(self, playback: Playback) -> None:
        self._playback = playback
        self.force.set_limits((playback.rig or self._usual_rig).limits)
        self.preview.set_cameras(playback.cameras)
        self.slider.blockSignals(True)
        self.slider.setRange(0, round(playback.duration_s * _TICKS_PER_S))
        self.slider.setValue(0)
        self.slider.setSingleStep(_TICKS_PER_S // 10)
        self.slider.setPageStep(_TICKS_PER_S)
        self.slider.blockSignals(False)
        self._enable(True)
        self._show(0)
        self.opened.emit()

    def _fail(self, error: Exception) -> None:
        self.close_session()
        self.failed.emit(str(error))

    def _enable(self, enabled: bool) -> None:
        for widget in (self.play, self.slider, self.speed):
            widget.setEnabled(enabled)

    def _show(self, tick: int) -> None:
        playback = self._playback
        if playback is None:
            return
        position_s = tick / _TICKS_PER_S
        self.clock.setText(f"{position_s:.1f} of {playback.duration_s:.1f} s")
        self._waiting = True
        self._background.do(lambda: (playback, playback.at(position_s, SPAN_S)), self._draw, self._fail)

    def _draw(self, shown: tuple[Playback, Instant]) -> None:
        playback, instant = shown
        self._waiting = False
        if playback is not self._playback:
            return
        self.force.show_rows(instant.force, playback.zero)
        self.preview.show_images(instant.images)
        self.preview.figures.setVisible(not instant.images)
        self.pose.show_state(RigState(tool=instant.tool), playback.rig or self._usual_rig)
        self.words.setText(instant.words)

    def _play(self, on: bool) -> None:
        self.play.setText("⏸" if on else "▶")
        self.play.setToolTip("Pause" if on else "Play")
        if not on:
            self._timer.stop()
            return
        if self.slider.value() == self.slider.maximum():
            self.slider.setValue(0)
        self._last_s = time.monotonic()
        self._timer.start()

    def _advance(self) -> None:
        """Go on by the time that has passed; an image that is not decoded yet is waited for."""
        if self._waiting:
            return
        now_s = time.monotonic()
        ticks = round((now_s - self._last_s) * float(self.speed.currentData()) * _TICKS_PER_S)
        if ticks == 0:
            return
        self._last_s = now_s
        self.slider.setValue(self.slider.value() + ticks)
        if self.slider.value() == self.slider.maximum():
            self.play.setChecked(False)
