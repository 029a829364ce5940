"""A body in three dimensions, turned by mouse and keys: depth-sorted polygons painted by Qt, on any display."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from estimator.report.drawing.rounding import round_figure
from estimator.report.drawing.view import View, normals
from gui.analysis.films import Film, Surface
from gui.inks import colour, ramp
from gui.theme import theme_of
from gui.widgets.view_3d.colour_bar import ROOM, paint_colour_bar
from gui.widgets.view_3d.shells import paint_within
from gui.widgets.view_3d.strokes import arrow, polygon

FloatArray = NDArray[np.float64]

_HOME = View(azimuth_deg=-115.0, elevation_deg=38.0)
_DEGREES_PER_PIXEL = 0.4
_KEY_DEGREES = 10.0
_ZOOM_STEP = 1.15
_MARGIN = 0.06
_TRIAD_SHARE = 0.14
_BEAD_RADIUS = 3.5
_RIM_OPACITY = 60
_CIRCLE = np.linspace(0.0, 2 * math.pi, 49)


class MeshView(QWidget):
    """Shows one instant of a film.

    Drag to turn, wheel to come closer, double-click for the first view; or arrow keys, + and −, Home.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.view = _HOME
        self.zoom = 1.0
        self._film: Film | None = None
        self._instant = 0
        self._dragged_from: QPointF | None = None
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setCursor(Qt.CursorShape.OpenHandCursor)
        self.setToolTip(
            "Drag or use the arrow keys to turn, wheel or + and − to zoom, Home for the first view"
        )
        self.setAccessibleName("Body in three dimensions")

    def sizeHint(self) -> QSize:
        """Room for a body and its colour bar."""
        return QSize(560, 380)

    def minimumSizeHint(self) -> QSize:
        """As little as a body can be recognised in."""
        return QSize(280, 200)

    def show_film(self, film: Film | None) -> None:
        """Show the first instant of a film; None for nothing."""
        self._film, self._instant = film, 0
        self.update()

    def show_instant(self, instant: int) -> None:
        """Show another instant of the film."""
        self._instant = instant
        self.update()

    def look(self, view: View, zoom: float = 1.0) -> None:
        """Look from elsewhere; the elevation stays between the poles."""
        elevation = min(max(view.elevation_deg, -90.0), 90.0)
        self.view = View((view.azimuth_deg + 180.0) % 360.0 - 180.0, elevation)
        self.zoom = min(max(zoom, 0.3), 12.0)
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take hold of the body."""
        self._dragged_from = event.position()
        self.setCursor(Qt.CursorShape.ClosedHandCursor)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go of the body."""
        self._dragged_from = None
        self.setCursor(Qt.CursorShape.OpenHandCursor)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn the body with the mouse."""
        if self._dragged_from is None:
            return
        moved = event.position() - self._dragged_from
        self._dragged_from = event.position()
        self._turn(-_DEGREES_PER_PIXEL * moved.x(), _DEGREES_PER_PIXEL * moved.y())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Go back to the first view."""
        self.look(_HOME)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Come closer, or go away."""
        self.look(self.view, self.zoom * _ZOOM_STEP ** (event.angleDelta().y() / 120))
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Turn, zoom, or go back to the first view."""
        turns = {
            Qt.Key.Key_Left: (-_KEY_DEGREES, 0.0),
            Qt.Key.Key_Right: (_KEY_DEGREES, 0.0),
            Qt.Key.Key_Up: (0.0, _KEY_DEGREES),
            Qt.Key.Key_Down: (0.0, -_KEY_DEGREES),
        }
        match event.key():
            case key if key in turns:
                self._turn(*turns[Qt.Key(key)])
            case Qt.Key.Key_Plus | Qt.Key.Key_Equal:
                self.look(self.view, self.zoom * _ZOOM_STEP)
            case Qt.Key.Key_Minus:
                self.look(self.view, self.zoom / _ZOOM_STEP)
            case Qt.Key.Key_Home:
                self.look(_HOME)
            case _:
                super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        painter = QPainter(self)
        if self._film is None:
            painter.setPen(colour("muted", theme_of(self)))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, "nothing to show yet")
        else:
            self._paint(painter, self._film)
        painter.end()

    def _turn(self, azimuth_deg: float, elevation_deg: float) -> None:
        view = View(self.view.azimuth_deg + azimuth_deg, self.view.elevation_deg + elevation_deg)
        self.look(view, self.zoom)

    def _paint(self, painter: QPainter, film: Film) -> None:
        room = self.rect().adjusted(0, 0, -ROOM if film.scale is not None else 0, 0)
        scale, centre = self._fit(film.surface.points, room)
        middle = np.array([room.center().x(), room.center().y()])

        def on_screen(points: FloatArray) -> FloatArray:
            return middle + scale * (self.view.project(points - centre)) * [1.0, -1.0]

        self._paint_surface(painter, film, on_screen(film.points_at(self._instant)))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        paint_within(painter, film, self._instant, self.view, on_screen, theme_of(self))
        self._paint_marked(painter, film, on_screen)
        if film.place is not None:
            centres, radius = film.place
            self._paint_place(painter, on_screen, centres[self._instant], radius)
        self._paint_beads(painter, film, on_screen)
        self._paint_triad(painter, film.surface, scale)
        paint_colour_bar(painter, film, self.size(), theme_of(self))

    def _fit(self, points: FloatArray, room: QRect) -> tuple[float, FloatArray]:
        """Return pixels a millimetre, and what is to be in the middle, so that the body at rest fills the room."""
        centre = (points.min(axis=0) + points.max(axis=0)) / 2
        size = np.maximum(np.ptp(self.view.project(points), axis=0), 1e-9)
        within = (1 - 2 * _MARGIN) * np.array([room.width(), room.height()])
        return self.zoom * float(np.min(within / size)), centre

    def _paint_surface(self, painter: QPainter, film: Film, screen: FloatArray) -> None:
        surface, points = film.surface, film.points_at(self._instant)
        colours = self._colours(film)
        corners = points[surface.pieces]
        facing = self.view.depth(normals(corners)) > 0
        order = np.argsort(self.view.depth(corners.mean(axis=1)))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        for number in order[facing[order]].tolist():
            paint = colours[number]
            painter.setPen(paint)
            painter.setBrush(paint)
            painter.drawConvexPolygon(polygon(screen[surface.pieces[number]]))
        rim = colour("ink", theme_of(self))
        rim.setAlpha(_RIM_OPACITY)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(rim, 0.6))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        turned = self.view.depth(normals(points[surface.rims])) > 0
        for corners_of in screen[surface.rims[turned]]:
            painter.drawPolygon(polygon(corners_of))

    def _colours(self, film: Film) -> list[QColor]:
        theme, parts = theme_of(self), film.surface.parts
        top = film.scale.top if film.scale is not None else 1.0
        known = [QColor(*rgb) for rgb in ramp(film.values[self._instant] / top, theme).tolist()]
        held = {"anchor": colour("anchor", theme), "grasp": colour("grasp", theme)}
        return [held.get(part, own) for part, own in zip(parts.tolist(), known, strict=True)]

    def _paint_marked(
        self, painter: QPainter, film: Film, on_screen: Callable[[FloatArray], FloatArray]
    ) -> None:
        """Hatch where a cause sits, also through the body."""
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QBrush(colour("ink", theme_of(self)), Qt.BrushStyle.BDiagPattern))
        points = film.points_at(self._instant)
        for corners in points[film.surface.pieces[film.marked]]:
            painter.drawConvexPolygon(polygon(on_screen(corners)))

    def _paint_place(
        self,
        painter: QPainter,
        on_screen: Callable[[FloatArray], FloatArray],
        centre: FloatArray,
        radius: float,
    ) -> None:
        """Draw the sphere of a local cause as it would shine through the body."""
        x, y = on_screen(centre)
        across = float(np.linalg.norm(on_screen(centre + self.view.right() * radius) - [x, y]))
        ink = colour("ink", theme_of(self))
        painter.setPen(QPen(ink, 1.6, Qt.PenStyle.DashLine))
        shade = QColor(ink)
        shade.setAlpha(40)
        painter.setBrush(shade)
        painter.drawEllipse(QPointF(x, y), across, across)
        painter.setPen(QPen(ink, 1.6))
        painter.drawLine(QPointF(x - 6, y), QPointF(x + 6, y))
        painter.drawLine(QPointF(x, y - 6), QPointF(x, y + 6))

    def _paint_beads(
        self, painter: QPainter, film: Film, on_screen: Callable[[FloatArray], FloatArray]
    ) -> None:
        beads, arrows = film.beads[self._instant], film.arrows[self._instant]
        seen = np.isfinite(beads).all(axis=1)
        paper, ink = colour("paper", theme_of(self)), colour("measured", theme_of(self))
        arrow_ink = colour("ink", theme_of(self))
        for start, tip in zip(
            on_screen(beads[seen]), on_screen(beads[seen] + np.nan_to_num(arrows[seen])), strict=True
        ):
            painter.setPen(QPen(paper, 1.2))
            painter.setBrush(ink)
            painter.drawEllipse(QPointF(*start), _BEAD_RADIUS, _BEAD_RADIUS)
            arrow(painter, start, tip, arrow_ink)

    def _paint_triad(self, painter: QPainter, surface: Surface, scale: float) -> None:
        """Draw the axes of the tissue frame in the lower left corner, each of a round length."""
        length = round_figure(_TRIAD_SHARE * float(np.ptp(surface.points, axis=0).max()) / self.zoom)
        muted = colour("muted", theme_of(self))
        painter.setPen(QPen(muted, 1.2))
        reach = scale * length
        origin = np.array([1.2 * reach + 8, self.height() - 0.6 * reach - 26])
        for (right, up), name in zip(self.view.project(np.eye(3)), "xyz", strict=True):
            tip = origin + reach * np.array([right, -up])
            arrow(painter, origin, tip, muted)
            label = origin + (reach + 9) * np.array([right, -up])
            painter.drawText(QRectF(label[0] - 8, label[1] - 8, 16, 16), Qt.AlignmentFlag.AlignCenter, name)
        place = QRectF(origin[0] - 60, self.height() - 20, 120, 18)
        painter.drawText(place, Qt.AlignmentFlag.AlignCenter, f"{length:g} mm")
