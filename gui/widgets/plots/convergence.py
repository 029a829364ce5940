"""How E and ν came to their values: over the iterations of a fit, or over the steps of a running session."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QVBoxLayout, QWidget

from estimator.fit.result import Estimate, ParameterEstimate
from estimator.report.estimation.facts import stage_starts
from gui.widgets.plots.legend import Legend
from gui.widgets.plots.plot_sheet import PlotSheet, Stroke

FloatArray = NDArray[np.float64]

_KILO = 1e-3
_WAY = Stroke("predicted", 1.6)
_BAND = Stroke("measured", 6.0)


class ConvergencePlots(QWidget):
    """E in kPa, ν and the misfit χ²."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.sheet = PlotSheet()
        self.legend = Legend()
        self._modulus = self.sheet.add(0, 0, "Young's modulus E", "E, kPa", "iteration")
        self._ratio = self.sheet.add(0, 1, "Poisson's ratio ν", "ν", "iteration")
        self._misfit = self.sheet.add(0, 2, "misfit", "log₁₀ χ²", "iteration")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.legend)
        layout.addWidget(self.sheet, 1)

    def show_estimate(self, estimate: Estimate) -> None:
        """Draw the iterates of a fit; bands are the final 95 % intervals."""
        self.sheet.empty()
        count = np.arange(len(estimate.iterates), dtype=np.float64)
        series = np.array(
            [
                (_KILO * i.values["youngs_modulus"], i.values["poisson_ratio"], np.log10(max(i.chi2, 1e-12)))
                for i in estimate.iterates
            ]
        )
        plots = (self._modulus, self._ratio, self._misfit)
        for plot, values in zip(plots, series.T, strict=True):
            plot.setLabel("bottom", "iteration")
            # misfits compare only within a stage, for every stage takes in more measurements
            stages = stage_starts(estimate.iterates) if plot is self._misfit else [0, len(count)]
            for start, stop in pairwise(stages):
                self.sheet.line(plot, count[start:stop], values[start:stop], _WAY)
            self.sheet.dots(plot, count, values, _WAY.ink, 6.0)
        for plot, parameter, factor in (
            (self._modulus, estimate.youngs_modulus, _KILO),
            (self._ratio, estimate.poisson_ratio, 1.0),
        ):
            low, high = parameter.interval95
            self.sheet.band(plot, factor * low, factor * high, _BAND.ink)
        self._misfit.show()
        self.legend.show_strokes([("iterate", _WAY), ("95 % interval", _BAND)])

    def show_history(
        self, steps: list[int], material: list[tuple[ParameterEstimate, ParameterEstimate]]
    ) -> None:
        """Draw E and ν with their 95 % intervals after each step of a session."""
        self.sheet.empty()
        at = np.array(steps, dtype=np.float64)
        for plot, column, factor in ((self._modulus, 0, _KILO), (self._ratio, 1, 1.0)):
            plot.setLabel("bottom", "step")
            values = factor * np.array([pair[column].value for pair in material])
            self.sheet.line(plot, at, values, _WAY)
            self.sheet.dots(plot, at, values, _WAY.ink, 6.0)
            ends = factor * np.array([pair[column].interval95 for pair in material])
            bars = np.column_stack([ends, np.full(len(at), np.nan)]).reshape(-1)
            self.sheet.line(plot, np.repeat(at, 3), bars, Stroke("measured", 2.0))
        self._misfit.hide()
        self.legend.show_strokes([("after a step", _WAY), ("95 % interval", _BAND)])
