"""The planned way of the gripper over the phantom, in three dimensions; turned by mouse or arrow keys."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget
from scipy.spatial.transform import Rotation

from daq.rig import Specimen
from estimator.errors import InputError
from estimator.experiment import Phantom
from estimator.report.drawing.view import normals
from estimator.report.drawing.within import contour, shells_within, skin_of
from estimator.surfaces.surface import Surface
from gui.recording.motion_profile import MotionProfile
from gui.theme import Theme, theme_of
from robot_drivers.protocols import FloatArray

_EDGES = [(0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
_TOP = (4, 5, 7, 6)
_KEYS = {
    Qt.Key.Key_Left: (-10.0, 0.0),
    Qt.Key.Key_Right: (10.0, 0.0),
    Qt.Key.Key_Up: (0.0, 10.0),
    Qt.Key.Key_Down: (0.0, -10.0),
}
_MARGIN_PX = 16


class PathView(QWidget):
    """Draws the phantom, its beads, and the gripper's frame along its way.

    Of a block its box is drawn; of a surface its skin, with the outlines of cavities (dashed) and regions in it.
    """

    def __init__(self, specimen: Specimen, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._specimen = specimen
        self._skin, self._within = _surfaces(specimen.phantom)
        self._profile: MotionProfile | None = None
        self._azimuth, self._elevation = -68.0, 30.0
        self._pressed: QPointF | None = None
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setToolTip("drag, or use the arrow keys, to turn")
        self.setAccessibleName("planned way of the gripper over the phantom")

    def show_profile(self, profile: MotionProfile | None) -> None:
        """Show a way, or none."""
        self._profile = profile
        self.update()

    def sizeHint(self) -> QSize:
        """Some room."""
        return QSize(300, 210)

    def minimumSizeHint(self) -> QSize:
        """Still legible."""
        return QSize(180, 150)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin to turn."""
        self._pressed = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn."""
        if self._pressed is not None:
            moved = event.position() - self._pressed
            self._pressed = event.position()
            self._turn(-0.5 * moved.x(), 0.5 * moved.y())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Turn by the arrow keys."""
        if (turn := _KEYS.get(Qt.Key(event.key()))) is not None:
            self._turn(*turn)
        else:
            super().keyPressEvent(event)

    def _turn(self, azimuth: float, elevation: float) -> None:
        self._azimuth += azimuth
        self._elevation = max(-89.0, min(89.0, self._elevation + elevation))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        theme = theme_of(self)
        corners = _corners(self._specimen.phantom.size_m)
        beads = np.array(self._specimen.fiducials_m).reshape(-1, 3)
        path, axes = self._path()
        scene = np.concatenate([corners, path, axes.reshape(-1, 3)])
        project = self._projection(scene)
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self._skin is None:
            self._paint_box(painter, theme, project(corners))
        else:
            self._paint_skin(painter, theme, self._skin, project)
        self._paint_beads(painter, theme, project(beads))
        self._paint_path(painter, theme, project(path), project(axes.reshape(-1, 3)))
        painter.end()

    def _path(self) -> tuple[FloatArray, FloatArray]:
        """Return the gripper's way (n, 3) and, where it stands, its frames (m, 4, 3): origin and ends of the axes."""
        if self._profile is None:
            return np.empty((0, 3)), np.empty((0, 4, 3))
        path = self._profile.position_m + np.array(self._specimen.grasp.centre)
        stands = np.searchsorted(self._profile.time_s, self._profile.windows_s[:, 1] - 1e-9)
        stands = np.unique(np.minimum(stands, len(path) - 1))
        length = 0.09 * max(self._specimen.phantom.size_m)
        turns = Rotation.from_rotvec(self._profile.rotation_vector[stands]).as_matrix()
        tips = path[stands][:, None] + length * turns.transpose(0, 2, 1)
        return path, np.concatenate([path[stands][:, None], tips], axis=1)

    def _projection(self, scene: FloatArray) -> "_Projection":
        turn = Rotation.from_euler("zx", [-self._azimuth - 90.0, self._elevation - 90.0], degrees=True)
        return _Projection(turn.as_matrix(), scene, self.width(), self.height())

    def _paint_skin(self, painter: QPainter, theme: Theme, skin: Surface, project: "_Projection") -> None:
        seen = project.faces(skin)
        fill, rim = QColor(theme.accent), QColor(theme.muted)
        fill.setAlpha(28)
        rim.setAlpha(70)
        painter.setBrush(fill)
        painter.setPen(QPen(rim, 0.6))
        corners = project(skin.vertices)
        for triangle in skin.triangles[seen].tolist():
            painter.drawConvexPolygon(QPolygonF([corners[node] for node in triangle]))
        self._paint_outline(painter, skin, project, QPen(QColor(theme.muted), 1.0))
        for shell, line in self._within:
            self._paint_outline(painter, shell, project, QPen(QColor(theme.text), 1.2, line))

    def _paint_outline(self, painter: QPainter, surface: Surface, project: "_Projection", pen: QPen) -> None:
        painter.setPen(pen)
        corners = project(surface.vertices)
        for a, b in contour(surface.triangles, project.faces(surface)).tolist():
            painter.drawLine(corners[a], corners[b])

    def _paint_box(self, painter: QPainter, theme: Theme, corners: list[QPointF]) -> None:
        fill = QColor(theme.accent)
        fill.setAlpha(28)
        painter.setBrush(fill)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.drawPolygon(QPolygonF([corners[index] for index in _TOP]))
        painter.setPen(QPen(QColor(theme.muted), 1.0))
        for a, b in _EDGES:
            painter.drawLine(corners[a], corners[b])

    def _paint_beads(self, painter: QPainter, theme: Theme, beads: list[QPointF]) -> None:
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.muted))
        for bead in beads:
            painter.drawEllipse(bead, 2.2, 2.2)

    def _paint_path(self, painter: QPainter, theme: Theme, path: list[QPointF], axes: list[QPointF]) -> None:
        painter.setPen(QPen(QColor(theme.text), 1.4))
        painter.drawPolyline(QPolygonF(path))
        for first in range(0, len(axes), 4):
            origin = axes[first]
            for tip, colour in zip(axes[first + 1 : first + 4], theme.channels, strict=True):
                painter.setPen(QPen(QColor(colour), 2.0))
                painter.drawLine(origin, tip)


class _Projection:
    """Parallel projection that fits a scene (n, 3) into the widget."""

    def __init__(self, turn: FloatArray, scene: FloatArray, width: int, height: int) -> None:
        flat = (scene @ turn.T)[:, :2]
        low, high = flat.min(axis=0), flat.max(axis=0)
        extent = np.maximum(high - low, 1e-9)
        room = np.maximum(np.array([width, height]) - 2 * _MARGIN_PX, 1)
        self._turn = turn
        self._scale = float((room / extent).min())
        self._middle = 0.5 * (low + high)
        self._centre = np.array([width, height]) / 2.0

    def __call__(self, points: FloatArray) -> list[QPointF]:
        """Return where points (n, 3) are drawn."""
        flat = ((points @ self._turn.T)[:, :2] - self._middle) * self._scale
        return [QPointF(x, y) for x, y in (self._centre + flat * (1.0, -1.0)).tolist()]

    def faces(self, surface: Surface) -> NDArray[np.bool_]:
        """Tell which triangles (t,) of a surface turn to the reader."""
        return np.asarray((normals(surface.corners) @ self._turn.T)[:, 2] > 0)


def _surfaces(phantom: Phantom) -> tuple[Surface | None, list[tuple[Surface, Qt.PenStyle]]]:
    """Return the skin of a phantom, and what lies within it with the line to draw it by.

    Without its files, which a rig may name before they are made, there is nothing but its box.
    """
    lines = {"cavity": Qt.PenStyle.DashLine, "region": Qt.PenStyle.SolidLine}
    try:
        return skin_of(phantom), [(one.surface, lines[one.kind]) for one in shells_within(phantom)]
    except InputError:
        return None, []


def _corners(size_m: tuple[float, float, float]) -> FloatArray:
    """Return the corners (8, 3) of a box around the origin, x fastest, the upper ones last."""
    signs = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
    return 0.5 * signs * np.array(size_m)
