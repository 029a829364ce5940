"""A body that is stepped through time: the view in three dimensions with a slider and a line that tells the instant."""

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSlider, QToolButton, QVBoxLayout, QWidget

from gui.analysis.films import Film
from gui.widgets.view_3d.mesh_view import MeshView

_INSTANT_MS = 250


class FilmPlayer(QWidget):
    """Shows a film; begins where the beads are missed most."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.view = MeshView()
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setAccessibleName("Instant of the retraction")
        self.slider.valueChanged.connect(self._step_to)
        self.play = QToolButton()
        self.play.setText("▶")
        self.play.setCheckable(True)
        self.play.setToolTip("Play through the retraction")
        self.play.toggled.connect(self._play)
        self.caption = QLabel()
        self._film: Film | None = None
        self._timer = QTimer(self, interval=_INSTANT_MS)
        self._timer.timeout.connect(self._advance)
        below = QHBoxLayout()
        below.addWidget(self.play)
        below.addWidget(self.slider, 1)
        below.addWidget(self.caption)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.view, 1)
        layout.addLayout(below)
        self.show_film(None)

    @property
    def instant(self) -> int:
        """Of the film, which is shown."""
        return self.slider.value()

    def show_film(self, film: Film | None, instant: int = 0) -> None:
        """Show a film from an instant on; None for nothing."""
        self.play.setChecked(False)
        self._film = film
        self.view.show_film(film)
        for widget in (self.play, self.slider):
            widget.setEnabled(film is not None)
        self.slider.setRange(0, len(film) - 1 if film is not None else 0)
        self.slider.setValue(instant)
        self._step_to(instant)

    def _step_to(self, instant: int) -> None:
        self.view.show_instant(instant)
        self.caption.setText(self._film.captions[instant] if self._film is not None else "")

    def _play(self, on: bool) -> None:
        self.play.setText("⏸" if on else "▶")
        if on and self.slider.value() == self.slider.maximum():
            self.slider.setValue(0)
        self._timer.start() if on else self._timer.stop()

    def _advance(self) -> None:
        if self.slider.value() == self.slider.maximum():
            self.play.setChecked(False)
        else:
            self.slider.setValue(self.slider.value() + 1)
