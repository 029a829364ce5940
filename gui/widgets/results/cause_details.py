"""One cause looked at: its signature beside the residual, what it closes, where it sits, and what E and ν become."""

from typing import cast

import numpy as np
from PySide6.QtCore import QEvent, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QTabWidget, QVBoxLayout, QWidget

from estimator.diagnosis.result import Diagnosis, Outcome, Trace
from estimator.effects.blocks import GROUPS, Block, Group
from estimator.report.diagnosis.findings import answer_words, material_sentence
from estimator.report.diagnosis.quantities import (
    STATE_WORDS,
    closure_text,
    detectable_text,
    parameters_text,
    sigma,
    slight_text,
)
from estimator.report.drawing.scene import MM, farthest_row
from gui.analysis.films import film_of_trace
from gui.widgets.cards import button, label
from gui.widgets.plots.plan_view import Arrows, PlanView
from gui.widgets.plots.plot_sheet import Stroke
from gui.widgets.plots.wrench_curves import Curve, WrenchCurves
from gui.widgets.tables import Facts
from gui.widgets.view_3d.film_player import FilmPlayer

# On a small screen the page is scrolled rather than the figures squeezed.
_FIGURES_HEIGHT = 300
_RESIDUAL = Stroke("measured")
_RESIDUAL_WAY = Stroke("measured", 2.0)
_EXPECTED = Stroke("predicted", 1.4, dashed=True)
_ACHIEVED = Stroke("truth", 1.8)


class CauseDetails(QWidget):
    """What a diagnosis knows of one cause.

    ``wanted`` asks for the model with that cause in it, refitted in full; it tells the cause's label.
    """

    wanted = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        # the theme may reach the widget while it is being made
        self._diagnosis: Diagnosis | None = None
        self._filmed: Trace | None = None
        super().__init__(parent)
        self._label = ""
        self.heading, self.words = label("", "heading"), label("", "muted")
        self.facts = Facts()
        self.add = button("Add to the model", tip="Refit E, ν and this cause in full; takes a minute or so")
        self.add.clicked.connect(lambda: self.wanted.emit(self._label))
        self.experiment = QComboBox()
        self.experiment.setAccessibleName("Experiment that the figures show")
        self.experiment.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self.experiment.currentIndexChanged.connect(self._draw)
        self.wrench, self.plan, self.body = WrenchCurves(), PlanView(), FilmPlayer()
        self.tabs = QTabWidget()
        self.tabs.setDocumentMode(True)
        self.tabs.setMinimumHeight(_FIGURES_HEIGHT)
        tabs: tuple[tuple[str, QWidget], ...] = (
            ("Force and torque", self.wrench),
            ("Beads", self.plan),
            ("On the phantom", self.body),
        )
        for name, widget in tabs:
            self.tabs.addTab(widget, name)
        row = QHBoxLayout()
        row.addWidget(self.heading, 1)
        row.addWidget(self.experiment)
        row.addWidget(self.add)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addLayout(row)
        layout.addWidget(self.words)
        layout.addWidget(self.facts)
        layout.addWidget(self.tabs, 1)

    def show_cause(self, diagnosis: Diagnosis, cause: str) -> None:
        """Look at an answer of a diagnosis: a label of the catalogue, "none" or "unknown"."""
        if diagnosis is not self._diagnosis:
            names = [trace.experiment.name for trace in diagnosis.traces]
            if [self.experiment.itemText(n) for n in range(self.experiment.count())] != names:
                self.experiment.blockSignals(True)
                self.experiment.clear()
                self.experiment.addItems(names)
                self.experiment.blockSignals(False)
        self._diagnosis, self._label = diagnosis, cause
        self.experiment.setVisible(len(diagnosis.traces) > 1)
        words = answer_words(cause)
        self.heading.setText(words[:1].upper() + words[1:])
        finding = diagnosis.effects.get(cause)
        self.words.setText("" if finding is None else finding.words.rstrip(".") + ".")
        self.words.setVisible(finding is not None)
        considered = diagnosis.considered.get(cause)
        self.add.setVisible(considered is not None and considered.achieved is None)
        self.facts.show_facts(cause_facts(diagnosis, cause))
        self._draw()

    def show_body(self) -> None:
        """Bring the body in three dimensions to the front."""
        self.tabs.setCurrentWidget(self.body)

    def changeEvent(self, event: QEvent) -> None:
        """Draw the curves in the colours of another theme."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and self._diagnosis is not None:
            self._draw_curves(self._diagnosis)

    def _draw(self) -> None:
        if self._diagnosis is None:
            return
        self._draw_curves(self._diagnosis)
        number = self._number
        trace = self._diagnosis.traces[number]
        shown = self._best(self._diagnosis)
        predicted = trace.before if shown is None else shown.channels[number]
        place = None if shown is None else shown.place
        film = film_of_trace(trace, predicted, place, cause_block(self._diagnosis, self._label))
        # the next cause is looked at where this one was
        instant = self.body.instant if trace is self._filmed else farthest_row(trace.experiment)
        self._filmed = trace
        self.body.show_film(film, instant)

    def _draw_curves(self, diagnosis: Diagnosis) -> None:
        considered = diagnosis.considered.get(self._label)
        expected = None if considered is None else considered.expected
        achieved = None if considered is None else considered.achieved
        trace = diagnosis.traces[self._number]
        self._draw_wrench(trace, expected, achieved, self._number)
        self._draw_beads(trace, self._best(diagnosis), self._number)

    @property
    def _number(self) -> int:
        """Of the experiment that the figures show."""
        return max(self.experiment.currentIndex(), 0)

    def _best(self, diagnosis: Diagnosis) -> Outcome | None:
        """Return what the cause does as far as it is known: refitted, else to first order."""
        considered = diagnosis.considered.get(self._label)
        return None if considered is None else considered.achieved or considered.expected

    def _draw_wrench(
        self, trace: Trace, expected: Outcome | None, achieved: Outcome | None, number: int
    ) -> None:
        baseline = trace.before[:, :6]
        curves = [Curve("residual without it", _RESIDUAL, trace.experiment.wrench - baseline)]
        for name, stroke, outcome in (
            ("signature, to first order", _EXPECTED, expected),
            ("with it in the model", _ACHIEVED, achieved),
        ):
            if outcome is not None:
                curves.append(Curve(name, stroke, outcome.channels[number][:, :6] - baseline))
        self.wrench.show_curves(trace.experiment.time, curves)

    def _draw_beads(self, trace: Trace, shown: Outcome | None, number: int) -> None:
        experiment, row = trace.experiment, farthest_row(trace.experiment)
        baseline = trace.before[row, 6:].reshape(-1, 3)
        places = experiment.fiducials[row]
        if not np.isfinite(places).any():
            self.plan.show_nothing()
            return
        fields = [Arrows("residual without it", _RESIDUAL_WAY, places - baseline)]
        if shown is not None:
            signature = shown.channels[number][row, 6:].reshape(-1, 3) - baseline
            fields.append(Arrows("signature", Stroke("predicted", 2.0), signature))
        self.plan.show_arrows(experiment, places, fields)


def cause_block(diagnosis: Diagnosis, cause: str) -> Block | None:
    """Return the block of the rig where an answer sits; None where it sits in none."""
    finding = diagnosis.effects.get(cause)
    return None if finding is None else GROUPS.get(cast(Group, finding.group))


def place_text(diagnosis: Diagnosis, cause: str) -> str:
    """Tell where a cause sits: its place in the tissue, else the block of the rig; empty where it sits in none."""
    considered = diagnosis.considered.get(cause)
    best = None if considered is None else considered.achieved or considered.expected
    block = cause_block(diagnosis, cause)
    words = "" if block is None else block.words
    if best is None or best.place is None:
        return words
    x, y, z = (MM * coordinate for coordinate in best.place.centre)
    return f"{words}, at x = {x:.1f}, y = {y:.1f}, z = {z:.1f} mm, radius {MM * best.place.radius:.1f} mm"


def cause_facts(diagnosis: Diagnosis, cause: str) -> dict[str, str]:
    """Return what is known of an answer, by name."""
    facts: dict[str, str] = {}
    finding = diagnosis.effects.get(cause)
    if finding is not None:
        facts["state"] = STATE_WORDS[finding.state]
        if size := parameters_text(finding):
            facts["size"] = size
        facts["would show from"] = detectable_text(finding)
        facts["where"] = place_text(diagnosis, cause)
    considered = diagnosis.considered.get(cause)
    if considered is None:
        return facts
    expected, achieved = considered.expected, considered.achieved
    facts["gap closes, predicted"] = _closure(expected)
    facts["gap closes, achieved"] = "not refitted yet" if achieved is None else _closure(achieved)
    facts["E and ν, without → with"] = material_sentence(
        diagnosis.before, (achieved or expected).material
    ).replace("->", "→")
    return facts


def _closure(outcome: Outcome) -> str:
    gap = outcome.gap
    sizes = f"{sigma(gap.before)} to {sigma(gap.after)}, noise {sigma(gap.floor)}"
    told = "; ".join(text for text in (sizes, slight_text(gap)) if text)
    return f"{closure_text(gap.closure_held_out, gap.closure_std)} ({told})"
