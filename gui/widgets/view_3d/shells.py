"""Cavities and regions of another stiffness, as they would shine through a body."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QPainter, QPen

from estimator.report.drawing.view import View
from estimator.report.drawing.within import contour, facing
from gui.analysis.films import Film
from gui.inks import Ink, colour
from gui.theme import Theme
from gui.widgets.view_3d.strokes import polygon

FloatArray = NDArray[np.float64]

_FILLED: dict[str, tuple[Ink, int]] = {"cavity": ("paper", 150), "region": ("ink", 70)}
_LINE = {"cavity": Qt.PenStyle.DashLine, "region": Qt.PenStyle.SolidLine}


def paint_within(
    painter: QPainter,
    film: Film,
    instant: int,
    view: View,
    on_screen: Callable[[FloatArray], FloatArray],
    theme: Theme,
) -> None:
    """Paint what lies within the body at an instant, with its name; ``on_screen`` places points (n, 3), mm."""
    for shell, points in zip(film.within, film.within_at(instant), strict=True):
        triangles = shell.surface.triangles
        seen, screen = facing(points, triangles, view), on_screen(points)
        ink, opacity = _FILLED[shell.kind]
        fill = colour(ink, theme)
        fill.setAlpha(opacity)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(fill)
        for corners in screen[triangles[seen]]:
            painter.drawConvexPolygon(polygon(corners))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(colour("ink", theme), 1.3, _LINE[shell.kind]))
        for start, end in screen[contour(triangles, seen)]:
            painter.drawLine(QPointF(*start), QPointF(*end))
        below = QRectF(screen[:, 0].mean() - 110, screen[:, 1].max() + 1, 220, 16)
        painter.drawText(below, Qt.AlignmentFlag.AlignCenter, shell.label)
