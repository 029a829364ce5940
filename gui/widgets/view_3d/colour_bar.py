"""What the colours of a body mean, beside it: a bar with its values and unit, and how arrows are magnified."""

import numpy as np
from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter

from gui.analysis.films import Film
from gui.inks import colour, ramp
from gui.theme import Theme

ROOM = 118
"""Pixels at the right edge that the bar needs."""

_WIDTH, _SHARE = 12, 0.55


def paint_colour_bar(painter: QPainter, film: Film, size: QSize, theme: Theme) -> None:
    """Draw it at the right edge of a view of that size; nothing where the film has no scale."""
    scale = film.scale
    if scale is None:
        return
    high = _SHARE * size.height()
    left, top = size.width() - ROOM + 22, (size.height() - high) / 2
    steps = np.linspace(1.0, 0.0, max(2, round(high)))
    for line, rgb in enumerate(ramp(steps, theme).tolist()):
        painter.fillRect(QRectF(left, top + line, _WIDTH, 1.5), QColor(*rgb))
    painter.setPen(colour("ink", theme))
    for share in (0.0, 0.5, 1.0):
        text = f"{share * scale.top:g} {scale.unit}"
        level = top + (1 - share) * high
        painter.drawText(QRectF(left + _WIDTH + 6, level - 9, 80, 18), Qt.AlignmentFlag.AlignVCenter, text)
    painter.setPen(colour("muted", theme))
    wrap = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap
    painter.drawText(QRectF(left, top - 62, ROOM - 26, 52), wrap, scale.title)
    if film.arrows.size:
        wrap = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap
        painter.drawText(QRectF(left, top + high + 12, ROOM - 26, 60), wrap, f"arrows × {film.magnified:g}")
