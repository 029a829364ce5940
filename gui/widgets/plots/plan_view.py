"""The phantom from above: outline, anchors, grasp, what lies within; paths of the beads, or arrows at them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QVBoxLayout, QWidget

from estimator.experiment import Experiment
from estimator.report.drawing.rounding import round_figure
from estimator.report.drawing.scene import MM, around
from estimator.report.drawing.silhouette import held_from_above, silhouette
from estimator.report.drawing.within import shells_within
from gui.inks import Ink
from gui.widgets.plots.legend import Legend
from gui.widgets.plots.plot_sheet import PlotSheet, Stroke

FloatArray = NDArray[np.float64]

_LONGEST_ARROW = 0.12
_DOTS = Stroke("measured")
_PATH = Stroke("predicted", 1.4)


@dataclass(frozen=True, slots=True, eq=False)
class Arrows:
    """A named field of arrows (m, 3) at the beads, m."""

    name: str
    stroke: Stroke
    ways: FloatArray


class PlanView(QWidget):
    """x to the right, y up, both in mm."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.sheet = PlotSheet()
        self.legend = Legend()
        self._plot = self.sheet.add(0, 0, "from above", "y, mm", "x, mm")
        self._plot.setAspectLocked(True)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.legend)
        layout.addWidget(self.sheet, 1)

    def show_nothing(self) -> None:
        """Take everything away."""
        self.sheet.empty()
        self.legend.show_strokes([])

    def show_paths(self, experiment: Experiment, predicted: FloatArray) -> None:
        """Draw the path of every bead as it was measured and predicted (n, m, 3), m."""
        self._surroundings(experiment)
        measured = MM * experiment.fiducials
        self.sheet.dots(self._plot, measured[:, :, 0].ravel(), measured[:, :, 1].ravel(), _DOTS.ink, 3.5)
        for bead in range(predicted.shape[1]):
            self.sheet.line(self._plot, MM * predicted[:, bead, 0], MM * predicted[:, bead, 1], _PATH)
        self.legend.show_strokes([("measured", _DOTS), ("predicted", _PATH)])
        self._plot.autoRange(padding=0.03)

    def show_arrows(self, experiment: Experiment, places: FloatArray, fields: Sequence[Arrows]) -> None:
        """Draw fields of arrows at the places (m, 3) of the beads, m, all exaggerated alike."""
        self._surroundings(experiment)
        lengths = np.concatenate([np.linalg.norm(field.ways[:, :2], axis=1) for field in fields])
        longest = float(np.nanmax(np.append(lengths, 0.0)))
        wanted = _LONGEST_ARROW * max(experiment.phantom.size_m[:2])
        factor = max(1.0, round_figure(wanted / longest)) if longest > 0 else 1.0
        self.sheet.dots(self._plot, MM * places[:, 0], MM * places[:, 1], _DOTS.ink, 6.0)
        for field in fields:
            self.sheet.arrows(self._plot, MM * places[:, :2], factor * MM * field.ways[:, :2], field.stroke)
        self.legend.show_strokes(
            [("bead", _DOTS), *((f"{field.name} × {factor:g}", field.stroke) for field in fields)]
        )
        self._plot.autoRange(padding=0.03)

    def _surroundings(self, experiment: Experiment) -> None:
        self.sheet.empty()
        self.sheet.pieces(self._plot, silhouette(experiment.phantom), Stroke("muted", 1.4))
        for anchor in experiment.anchors:
            self._outline(held_from_above(anchor, experiment.phantom), "anchor", 0.3)
        self._outline(held_from_above(experiment.grasp.box, experiment.phantom), "grasp", 0.3)
        for shell in shells_within(experiment.phantom):
            opacity = 0.12 if shell.kind == "region" else 0.0
            self._outline(around(MM * shell.surface.vertices[:, :2]), "muted", opacity)

    def _outline(self, corners: FloatArray, ink: Ink, opacity: float) -> None:
        self.sheet.outline(self._plot, corners, ink, opacity)
