"""The colours of the reports, for what the window paints: a measured value is blue on the page and on the screen."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QColor

from estimator.report.theme import COLOURS
from gui.theme import Theme

Ink = Literal["paper", "ink", "muted", "line", "panel", "measured", "predicted", "truth", "anchor", "grasp"]

# From nothing to much, on a light and on a dark background: M. Okabe and K. Ito's vermilion, thinned and thickened.
_RAMPS = {
    "light": ("#e9ecef", "#f3d9b8", "#eea15f", "#d55e00", "#7f2d00"),
    "dark": ("#39424d", "#6b5140", "#b0673a", "#ff8a3d", "#ffd9a8"),
}


def colour(ink: Ink, theme: Theme) -> QColor:
    """Return a colour of the reports as it looks on the background of a theme."""
    twins = COLOURS[ink]
    return QColor(twins.dark if theme.dark else twins.light)


def ramp(shares: NDArray[np.float64], theme: Theme) -> NDArray[np.uint8]:
    """Return red, green and blue (..., 3) for shares (...) from 0 to 1; the first colour where a share is NaN."""
    stops = _RAMPS["dark" if theme.dark else "light"]
    table = np.array([[c.red(), c.green(), c.blue()] for c in map(QColor, stops)], dtype=np.float64)
    at = np.linspace(0.0, 1.0, len(table))
    clipped = np.clip(np.nan_to_num(shares), 0.0, 1.0)
    return np.stack([np.interp(clipped, at, table[:, c]) for c in range(3)], axis=-1).astype(np.uint8)
