"""Polygons and arrows at places on the screen."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

FloatArray = NDArray[np.float64]


def polygon(points: FloatArray) -> QPolygonF:
    """Return the polygon through (n, 2) places on the screen."""
    return QPolygonF([QPointF(x, y) for x, y in points.tolist()])


def arrow(painter: QPainter, start: FloatArray, tip: FloatArray, ink: QColor) -> None:
    """Draw an arrow between two places on the screen; a very short one has no head."""
    way = tip - start
    length = float(np.hypot(*way))
    if length < 1.0:
        return
    painter.setPen(QPen(ink, 1.4))
    painter.drawLine(QPointF(*start), QPointF(*tip))
    if length > 5.0:
        along, across = way / length, np.array([-way[1], way[0]]) / length
        head = [tip, tip - 5.0 * along + 2.4 * across, tip - 5.0 * along - 2.4 * across]
        painter.setBrush(ink)
        painter.drawPolygon(polygon(np.array(head)))
