"""The cameras' live images with the beads, their numbers, and how well a stereo pair agrees."""

from collections.abc import Mapping, Sequence
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QImage, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QGridLayout, QSizePolicy, QVBoxLayout, QWidget

from gui.rig.bead_marks import BeadView, Marks
from gui.theme import theme_of
from gui.widgets.cards import label

_MARK_RADIUS = 7.0
_COLUMNS = 2
_NAMED, _UNNAMED = "#4fe08a", "#ffb347"


class CameraPane(QWidget):
    """One camera's image, fitted into the widget, and marks over it."""

    def __init__(self, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._name = name
        self._image: QImage | None = None
        self._marks: Marks | None = None
        self._marked_size = (1, 1)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName(f"live image of the {name} camera")

    def sizeHint(self) -> QSize:
        """As the cameras' images."""
        return QSize(322, 241)

    def minimumSizeHint(self) -> QSize:
        """Still legible."""
        return QSize(200, 150)

    def show_image(self, image: NDArray[np.uint8]) -> None:
        """Show an image, grey (height, width) or blue-green-red (height, width, 3)."""
        pixels = np.ascontiguousarray(image)
        grey = pixels.ndim == 2
        kind = QImage.Format.Format_Grayscale8 if grey else QImage.Format.Format_BGR888
        height, width = pixels.shape[:2]
        # the copy owns its pixels; the array need not outlive it
        self._image = QImage(pixels.data, width, height, pixels.strides[0], kind).copy()
        self.update()

    def show_marks(self, marks: Marks | None, size: tuple[int, int] = (1, 1)) -> None:
        """Show marks on an image of this size, px, or none."""
        self._marks, self._marked_size = marks, size
        self.update()

    def clear(self) -> None:
        """Show nothing."""
        self._image = self._marks = None
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        theme = theme_of(self)
        painter = QPainter(self)
        if self._image is None:
            painter.fillRect(self.rect(), QColor(theme.window))
            painter.setPen(QColor(theme.muted))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, f"{self._name}: no image")
            painter.end()
            return
        box = self._fitted(self._image.width(), self._image.height())
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(box, self._image)
        if self._marks is not None:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            self._paint_marks(painter, box, self._marks)
        painter.end()

    def _fitted(self, width: int, height: int) -> QRectF:
        scale = min(self.width() / width, self.height() / height)
        return QRectF(
            (self.width() - scale * width) / 2,
            (self.height() - scale * height) / 2,
            scale * width,
            scale * height,
        )

    def _paint_marks(self, painter: QPainter, box: QRectF, marks: Marks) -> None:
        font = QFont(self.font())
        font.setPointSizeF(0.8 * font.pointSizeF())
        painter.setFont(font)
        scale = np.array([box.width() / self._marked_size[0], box.height() / self._marked_size[1]])
        places = (marks.centres + 0.5) * scale + np.array([box.left(), box.top()])
        for (x, y), name in zip(places.tolist(), marks.names.tolist(), strict=True):
            painter.setPen(QPen(QColor(_NAMED if name >= 0 else _UNNAMED), 1.6))
            painter.drawEllipse(QPointF(x, y), _MARK_RADIUS, _MARK_RADIUS)
            if name >= 0:
                painter.drawText(QPointF(x + _MARK_RADIUS + 1, y - 2), str(name))


class CameraPreview(QWidget):
    """The cameras, two in a row, and a line of figures."""

    def __init__(self, cameras: Sequence[str], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.panes: dict[str, CameraPane] = {}
        self.figures = label("", "muted")
        self._told = ""
        self._grid = QGridLayout()
        self._grid.setSpacing(8)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(self._grid, stretch=1)
        column.addWidget(self.figures)
        self.set_cameras(cameras)

    def set_cameras(self, cameras: Sequence[str]) -> None:
        """Show these cameras from now on, and no image yet."""
        if tuple(self.panes) != tuple(cameras):
            for pane in self.panes.values():
                self._grid.removeWidget(pane)
                pane.deleteLater()
            self.panes = {name: CameraPane(name) for name in cameras}
            for number, pane in enumerate(self.panes.values()):
                self._grid.addWidget(pane, *divmod(number, _COLUMNS))
        self.clear()

    def show_images(self, images: Mapping[str, NDArray[np.uint8]]) -> None:
        """Show the latest image of each camera that has one."""
        for name, image in images.items():
            self.panes[name].show_image(image)
            self.figures.setText(self._told)

    def show_beads(self, view: BeadView) -> None:
        """Show what images of one moment showed; cameras beyond those that measure have no marks."""
        for pane, marks in zip_longest(self.panes.values(), view.marks):
            pane.show_marks(marks, view.size)
        told = f"{view.named} of {view.expected} beads recognised"
        if len(view.epipolar_px):
            rms, most = float(np.sqrt(np.mean(view.epipolar_px**2))), float(view.epipolar_px.max())
            told += f", epipolar error {rms:.2f} px rms, {most:.2f} px at most"
        self._told = f"{told}. {view.words}" if view.words else told
        self.figures.setText(self._told)

    def clear(self) -> None:
        """Show nothing."""
        for pane in self.panes.values():
            pane.clear()
        self._told = ""
        self.figures.setText("no image yet")
