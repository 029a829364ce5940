"""The uncertainty budget: what it comes to, which device to improve, and every source."""

from PySide6.QtWidgets import QVBoxLayout, QWidget

from estimator.fit.budget.budget import Budget
from estimator.report.estimation.budget import (
    HALVED_NOTE,
    budget_sentences,
    device_head,
    device_rows,
    source_head,
    source_rows,
)
from gui.widgets.cards import label
from gui.widgets.tables import ReadTable

_MOST_DEVICE_ROWS = 7


class BudgetTab(QWidget):
    """Sentences, and below them the tables of devices and of sources, whose columns are those of the parameters."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.sentences = label("")
        self.devices, self.sources = ReadTable(()), ReadTable(())
        self._note = label(
            f"A star marks what the fit knows of, so that the interval above holds it. {HALVED_NOTE}", "muted"
        )
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 8, 0, 0)
        layout.addWidget(self.sentences)
        layout.addWidget(self.devices)
        layout.addWidget(self.sources, 1)
        layout.addWidget(self._note)

    def show_budget(self, budget: Budget) -> None:
        """Show a budget."""
        self.sentences.setText("\n".join(budget_sentences(budget)))
        self.devices.show_table(device_head(budget), device_rows(budget))
        self.sources.show_table(source_head(budget), source_rows(budget))
        rows = min(self.devices.rowCount(), _MOST_DEVICE_ROWS)
        height = self.devices.horizontalHeader().sizeHint().height() + rows * self.devices.rowHeight(0)
        self.devices.setFixedHeight(height + 2 * self.devices.frameWidth())
