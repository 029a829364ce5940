"""Force and torque against time: dots for what was measured, lines for what was predicted."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QVBoxLayout, QWidget

from estimator.report.channels import WRENCH_CHANNELS
from gui.widgets.plots.legend import Legend
from gui.widgets.plots.plot_sheet import PlotSheet, Stroke

FloatArray = NDArray[np.float64]

# Small channels keep this share of the span of the largest, so that they look small.
_SMALLEST_SHARE = 0.25
_MARGIN = 0.08
_MILLI = 1e3


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A named wrench (n, 6) through time, N and N·m; a stroke of width 0 is dots."""

    name: str
    stroke: Stroke
    wrench: FloatArray


class WrenchCurves(QWidget):
    """Six panels, force (N) above and torque (mN·m) below."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.sheet = PlotSheet()
        self.legend = Legend()
        self._panels = [
            self.sheet.add(
                number // 3,
                number % 3,
                name,
                ("force, N", "torque, mN·m")[number // 3] if number % 3 == 0 else "",
                "time, s" if number >= 3 else "",
            )
            for number, name in enumerate(WRENCH_CHANNELS)
        ]
        for panel in self._panels[1:]:
            panel.setXLink(self._panels[0])
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.legend)
        layout.addWidget(self.sheet, 1)

    def show_curves(self, time: FloatArray, curves: Sequence[Curve]) -> None:
        """Draw curves over the same instants (n,), s; the first lies below the others."""
        self.sheet.empty()
        self.legend.show_strokes([(curve.name, curve.stroke) for curve in curves])
        if not len(curves):
            return
        shown = [curve.wrench * np.repeat([1.0, _MILLI], 3) for curve in curves]
        for number, (panel, (low, high)) in enumerate(zip(self._panels, _limits(shown), strict=True)):
            for curve, values in zip(curves, shown, strict=True):
                if curve.stroke.width > 0:
                    self.sheet.line(panel, time, values[:, number], curve.stroke)
                else:
                    self.sheet.dots(panel, time, values[:, number], curve.stroke.ink)
            panel.setYRange(low, high, padding=0)
        self._panels[0].setXRange(float(time[0]), float(time[-1]), padding=0.02)


def _limits(shown: Sequence[FloatArray]) -> list[tuple[float, float]]:
    """Return the limits of each of six axes."""
    stacked = np.vstack(shown)
    known = np.where(np.isfinite(stacked), stacked, 0.0)
    low, high = known.min(axis=0), known.max(axis=0)
    limits = []
    for kind in (slice(0, 3), slice(3, 6)):
        span = high[kind] - low[kind]
        wide = np.maximum(span, max(_SMALLEST_SHARE * float(span.max()), 1e-9)) * (1 + 2 * _MARGIN)
        middle = (low[kind] + high[kind]) / 2
        limits += [(float(m - w / 2), float(m + w / 2)) for m, w in zip(middle, wide, strict=True)]
    return limits
