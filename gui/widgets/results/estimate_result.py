"""What an estimation came to: the answer on top, and the figures behind it."""

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QEvent, Qt
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QTabWidget, QVBoxLayout, QWidget

from estimator.fit.online import OnlineEstimate
from estimator.fit.result import Estimate
from estimator.report.drawing.scene import farthest_row
from estimator.report.estimation.facts import fit_facts, residual_rows, specimen_facts
from estimator.report.estimation.findings import caveats, parameter_texts, step_text, taken_up, verdict
from gui.analysis.films import film_of_fit
from gui.widgets.cards import Card, button, label, scrolled
from gui.widgets.plots.convergence import ConvergencePlots
from gui.widgets.plots.plan_view import PlanView
from gui.widgets.plots.plot_sheet import Stroke
from gui.widgets.plots.wrench_curves import Curve, WrenchCurves
from gui.widgets.results.budget_tab import BudgetTab
from gui.widgets.tables import Facts, ReadTable
from gui.widgets.view_3d.film_player import FilmPlayer

_MEASURED, _PREDICTED = Stroke("measured"), Stroke("predicted", 1.6)
_HINT = (
    "Choose sessions of one phantom on the left and press Estimate; with several, the intervals are narrower."
)


class EstimateResult(QWidget):
    """The answer, and the figures behind it."""

    def __init__(self, parent: QWidget | None = None) -> None:
        # the theme may reach the widget while it is being made
        self._estimate: Estimate | None = None
        super().__init__(parent)
        self.parameters, self.verdict, self.remarks = label("", "figure"), label(""), label("", "muted")
        self.experiment = QComboBox()
        self.experiment.setAccessibleName("Experiment that the figures show")
        self.experiment.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self.experiment.currentIndexChanged.connect(self._show_experiment)
        self.save = button("Save report…", tip="An HTML page, and the numbers as JSON beside it")
        self.diagnose = button("Diagnose", tip="Look for what the model leaves out, with these sessions")
        self.wrench, self.plan, self.body = WrenchCurves(), PlanView(), FilmPlayer()
        self.residuals = ReadTable(("channel", "rms", "rms, σ", "scatter, σ"))
        self.convergence = ConvergencePlots()
        self.budget = BudgetTab()
        self.fit_facts, self.specimen_facts = Facts(), Facts()
        self._hint = label(_HINT, "muted")
        self._card = Card()
        for told in (self.parameters, self.verdict, self.remarks):
            self._card.body.addWidget(told)
        self.tabs = QTabWidget()
        self.tabs.setDocumentMode(True)
        tabs: tuple[tuple[str, QWidget], ...] = (
            ("Force and torque", self.wrench),
            ("Beads", self.plan),
            ("Body", self.body),
            ("Residuals", self.residuals),
            ("Convergence", self.convergence),
            ("Uncertainty", self.budget),
            ("Numbers", scrolled(_beside(self.fit_facts, self.specimen_facts))),
        )
        for name, widget in tabs:
            self.tabs.addTab(widget, name)
        row = QHBoxLayout()
        row.addWidget(self.experiment)
        row.addStretch()
        row.addWidget(self.diagnose)
        row.addWidget(self.save)
        self._shown = QWidget()
        shown = QVBoxLayout(self._shown)
        shown.setContentsMargins(0, 0, 0, 0)
        shown.addWidget(self._card)
        shown.addLayout(row)
        shown.addWidget(self.tabs, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._hint, 0, Qt.AlignmentFlag.AlignTop)
        layout.addWidget(self._shown, 1)
        self._shown.hide()

    def show_estimate(self, estimate: Estimate) -> None:
        """Show an estimate and the first of its experiments."""
        self._estimate = estimate
        self.parameters.setText("\n".join(parameter_texts(estimate)))
        self.verdict.setText(verdict(estimate))
        remarks = [*caveats(estimate), *estimate.identifiability, taken_up(estimate)]
        self.remarks.setText("\n".join(filter(None, remarks)))
        self.remarks.setVisible(bool(self.remarks.text()))
        self.fit_facts.show_facts(fit_facts(estimate))
        self.specimen_facts.show_facts(specimen_facts(estimate.fits[0].experiment))
        if estimate.budget is not None:
            self.budget.show_budget(estimate.budget)
        self.experiment.blockSignals(True)
        self.experiment.clear()
        self.experiment.addItems([fit.experiment.name for fit in estimate.fits])
        self.experiment.blockSignals(False)
        self.experiment.setVisible(len(estimate.fits) > 1)
        self._show_tabs(whole=True)
        self.tabs.setTabVisible(self.tabs.indexOf(self.budget), estimate.budget is not None)
        self._show_experiment(0)

    def show_history(self, history: Sequence[OnlineEstimate], late_s: float) -> None:
        """Show E and ν after the last step of a running session, measured so long ago, and how they came there."""
        last = history[-1]
        self._estimate = None
        self.parameters.setText(step_text(last).replace("), ", ")\n"))
        self.verdict.setText(
            f"After step {last.step} of a running session, {late_s:.1f} s after it was measured; "
            f"residuals {last.noise_ratio:.2f} times the stated noise."
        )
        self.remarks.hide()
        self.convergence.show_history(
            [one.step for one in history],
            [(one.parameters["youngs_modulus"], one.parameters["poisson_ratio"]) for one in history],
        )
        self._show_tabs(whole=False)

    def _show_tabs(self, *, whole: bool) -> None:
        """Offer what a whole session has, or what a running one has: its convergence."""
        for number in range(self.tabs.count()):
            self.tabs.setTabVisible(number, whole or self.tabs.widget(number) is self.convergence)
        for widget in (self.save, self.diagnose):
            widget.setEnabled(whole)
        self._hint.hide()
        self._shown.show()

    def changeEvent(self, event: QEvent) -> None:
        """Draw the curves in the colours of another theme."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and self._estimate is not None:
            self._draw_curves(self._estimate)

    def _show_experiment(self, number: int) -> None:
        if self._estimate is None or number < 0:
            return
        fit = self._estimate.fits[number]
        self._draw_curves(self._estimate)
        self.body.show_film(film_of_fit(self._estimate.mesh, fit), farthest_row(fit.experiment))
        self.residuals.show_rows([(row.channel, *row.texts) for row in residual_rows(fit)])

    def _draw_curves(self, estimate: Estimate) -> None:
        fit = estimate.fits[max(self.experiment.currentIndex(), 0)]
        self.wrench.show_curves(
            fit.experiment.time,
            [Curve("measured", _MEASURED, fit.experiment.wrench), Curve("predicted", _PREDICTED, fit.wrench)],
        )
        if np.isfinite(fit.experiment.fiducials).any():
            self.plan.show_paths(fit.experiment, fit.fiducials)
        else:
            self.plan.show_nothing()
        self.convergence.show_estimate(estimate)


def _beside(left: QWidget, right: QWidget) -> QWidget:
    both = QWidget()
    layout = QHBoxLayout(both)
    layout.setSpacing(40)
    for widget in (left, right):
        layout.addWidget(widget, 1, Qt.AlignmentFlag.AlignTop)
    return both
