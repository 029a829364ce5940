"""What a diagnosis says: the answer on top, then causes, gap, what to do next, and another diagnosis beside it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QTabWidget, QVBoxLayout, QWidget

from estimator.diagnosis.result import Advice, Diagnosis
from estimator.report.diagnosis.findings import (
    advice_text,
    explanations,
    gap_rows,
    gap_sentence,
    material_sentence,
    open_questions,
    verdict_sentence,
)
from estimator.report.diagnosis.quantities import closure_text, sigma
from gui.analysis.comparison import comparison_rows
from gui.widgets.cards import Card, button, label, scrolled
from gui.widgets.results.cause_details import CauseDetails
from gui.widgets.results.ranking import Ranking, ranked_causes
from gui.widgets.split import side_by_side
from gui.widgets.tables import ReadTable


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """A diagnosis with the name by which it is called, and what it was made from."""

    name: str
    sources: tuple[Path, ...]
    diagnosis: Diagnosis


class DiagnosisResult(QWidget):
    """Shows one diagnosis, and a second one to compare with.

    ``cause_wanted`` tells the label of a cause to be put into the model, ``manoeuvre_wanted`` the Advice to carry out.
    """

    cause_wanted = Signal(str)
    manoeuvre_wanted = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._shown: Diagnosed | None = None
        self._all: tuple[Diagnosed, ...] = ()
        self.verdict, self.told = label("", "heading"), label("", "muted")
        self.save = button("Save report…", tip="An HTML page, and the numbers as JSON beside it")
        self.ranking, self.details = Ranking(), CauseDetails()
        self.ranking.chosen.connect(self._look_at)
        self.details.wanted.connect(self.cause_wanted)
        self.gaps = ReadTable(("", "before", "after", "noise alone", "closes"))
        self.next = _Next()
        self.next.wanted.connect(self.manoeuvre_wanted)
        self.other = QComboBox()
        self.other.setAccessibleName("Diagnosis to compare with")
        self.other.currentIndexChanged.connect(self._compare)
        self.comparison = ReadTable(("", "this diagnosis", "the other"))
        self.tabs = QTabWidget()
        self.tabs.setDocumentMode(True)
        tabs: tuple[tuple[str, QWidget], ...] = (
            ("Causes", side_by_side(self.ranking, self.details, (400, 600))),
            ("Gap", self.gaps),
            ("What next", scrolled(self.next)),
            ("Compare", self._compared()),
        )
        for name, widget in tabs:
            self.tabs.addTab(widget, name)
        card = Card()
        top = QHBoxLayout()
        top.addWidget(self.verdict, 1)
        top.addWidget(self.save, 0, Qt.AlignmentFlag.AlignTop)
        card.body.addLayout(top)
        card.body.addWidget(self.told)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(card)
        layout.addWidget(self.tabs, 1)

    @property
    def shown(self) -> Diagnosed | None:
        """What is shown."""
        return self._shown

    def show_diagnosis(self, shown: Diagnosed, all_of_them: Sequence[Diagnosed]) -> None:
        """Show a diagnosis; any of the others can be compared with it."""
        self._shown, self._all = shown, tuple(all_of_them)
        diagnosis = shown.diagnosis
        self.verdict.setText(verdict_sentence(diagnosis))
        material = material_sentence(diagnosis.before, diagnosis.after).replace("->", "→")
        self.told.setText(
            "\n".join(
                [
                    *explanations(diagnosis),
                    gap_sentence(diagnosis.gap),
                    f"Without → with the causes: {material}",
                ]
            )
        )
        self.ranking.show_causes(ranked_causes(diagnosis))
        self.gaps.show_rows(
            [
                (
                    name,
                    sigma(gap.before),
                    sigma(gap.after),
                    sigma(gap.floor),
                    closure_text(gap.closure_held_out, gap.closure_std),
                )
                for name, gap in gap_rows(diagnosis)
            ],
        )
        self.next.show_advice(diagnosis)
        self.other.blockSignals(True)
        self.other.clear()
        self.other.addItems([one.name for one in self._others()])
        self.other.blockSignals(False)
        self._compare(0)

    def _others(self) -> list[Diagnosed]:
        return [one for one in self._all if one is not self._shown]

    def _look_at(self, cause: str) -> None:
        if self._shown is not None:
            self.details.show_cause(self._shown.diagnosis, cause)

    def _compare(self, number: int) -> None:
        others = self._others()
        self.other.setEnabled(bool(others))
        if self._shown is None or not 0 <= number < len(others):
            self.comparison.show_rows(
                [("nothing to compare with yet; diagnose other sessions as well", "", "")]
            )
            return
        self.comparison.show_rows(comparison_rows(self._shown.diagnosis, others[number].diagnosis))

    def _compared(self) -> QWidget:
        made = QWidget()
        layout = QVBoxLayout(made)
        row = QHBoxLayout()
        told = label("Beside this diagnosis", "muted")
        told.setWordWrap(False)
        row.addWidget(told)
        row.addWidget(self.other, 1)
        layout.addLayout(row)
        layout.addWidget(self.comparison, 1)
        return made


class _Next(QWidget):
    """What the data do not say, and the manoeuvres and measurements that would; ``wanted`` tells the Advice."""

    wanted = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self._layout = QVBoxLayout(self)
        self._layout.setSpacing(10)
        self._parts: list[QWidget] = []

    def show_advice(self, diagnosis: Diagnosis) -> None:
        """Show the advice of a diagnosis, the best first, then its open questions."""
        for part in self._parts:
            self._layout.removeWidget(part)
            part.hide()
            part.deleteLater()
        self._parts = [self._advice(advice) for advice in diagnosis.next_experiment]
        if not self._parts:
            self._parts = [label("The leading causes are told apart; no further experiment is called for.")]
        if questions := open_questions(diagnosis):
            card = Card("What these data cannot tell")
            for sentence in questions:
                card.body.addWidget(label(sentence, "muted"))
            self._parts.append(card)
        for part in self._parts:
            self._layout.addWidget(part)
        self._layout.setAlignment(Qt.AlignmentFlag.AlignTop)

    def _advice(self, advice: Advice) -> QWidget:
        card = Card()
        row = QHBoxLayout()
        row.addWidget(label(advice_text(advice)), 1)
        if advice.motion is not None:
            put = button(
                "Put into the queue", "primary", "Add this manoeuvre to the queue of the Acquire page"
            )
            put.clicked.connect(lambda: self.wanted.emit(advice))
            row.addWidget(put)
        card.body.addLayout(row)
        return card
