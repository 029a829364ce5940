"""One row for each device: lamp, identity, rate, age, drops, how well its clock is known, real or emulated."""

import math
from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QComboBox, QGridLayout, QHBoxLayout, QLabel, QSizePolicy, QWidget

from gui.rig.state import DeviceRow, RigState
from gui.widgets.cards import label, set_role
from gui.widgets.lamp import Lamp

REAL, EMULATED = "real", "emulated"
_TITLES = ("", "device", "identity", "rate", "age", "lost", "not written", "clock known to", "source")
_FIGURES = ("rate", "age", "lost", "not written", "clock known to")


class DeviceTable(QWidget):
    """Renders the rows of a :class:`gui.rig.state.RigState`.

    Parameters
    ----------
    roles : of the devices
    has_real : whether there is a rig file; without one every device is emulated
    """

    def __init__(self, roles: Sequence[str], has_real: bool, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(12)
        grid.setVerticalSpacing(8)
        grid.setColumnStretch(2, 1)
        for column, title in enumerate(_TITLES):
            right = title in _FIGURES
            side = Qt.AlignmentFlag.AlignRight if right else Qt.AlignmentFlag.AlignLeft
            grid.addWidget(label(title, "muted"), 0, column, side)
        self._rows = {role: _Row(grid, number, role, has_real) for number, role in enumerate(roles, start=1)}

    @property
    def emulated(self) -> frozenset[str]:
        """The roles of the devices that are to be emulated."""
        return frozenset(role for role, row in self._rows.items() if row.source.currentText() == EMULATED)

    def set_emulated(self, roles: frozenset[str]) -> None:
        """Choose which devices are to be emulated."""
        for role, row in self._rows.items():
            row.source.setCurrentText(EMULATED if role in roles else REAL)

    def show_state(self, state: RigState) -> None:
        """Show a state; the switches are for before and after a connection."""
        for row in state.rows:
            self._rows[row.role].show_row(row)
        for shown in self._rows.values():
            shown.source.setEnabled(state.phase == "disconnected" and shown.source.count() > 1)


class _Row:
    def __init__(self, grid: QGridLayout, number: int, role: str, has_real: bool) -> None:
        self._lamp, self._sync_lamp = Lamp(), Lamp()
        self._identity = QLabel("–")
        self._identity.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self._rate, self._age, self._lost, self._dropped, self._sync = (_figure() for _ in range(5))
        self.source = QComboBox()
        self.source.addItems([REAL, EMULATED] if has_real else [EMULATED])
        self.source.setAccessibleName(f"source of the {role}")
        sync = QWidget()
        row = QHBoxLayout(sync)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self._sync_lamp)
        row.addWidget(self._sync, stretch=1)
        name = QLabel(role)
        name.setProperty("role", "heading")
        for column, widget in enumerate(
            (
                self._lamp,
                name,
                self._identity,
                self._rate,
                self._age,
                self._lost,
                self._dropped,
                sync,
                self.source,
            )
        ):
            grid.addWidget(widget, number, column)

    def show_row(self, row: DeviceRow) -> None:
        """Show a device."""
        self._lamp.show_health(row.health)
        who = row.identity
        self._identity.setText(
            "–" if who is None else f"{who.model} {who.serial}".strip() + f" at {who.address}"
        )
        self._identity.setToolTip(
            "" if who is None else "\n".join(f"{k}: {v}" for k, v in who.details.items())
        )
        self._rate.setText(
            "–" if math.isnan(row.rate_hz) else f"{row.rate_hz:,.1f} Hz".replace(",", "\u2009")
        )
        self._sync_lamp.show_health(row.sync_health)
        counts = row.counts
        if counts is None:
            for field in (self._age, self._lost, self._dropped, self._sync):
                field.setText("–")
            return
        self._age.setText("–" if math.isinf(counts.age_s) else f"{1e3 * counts.age_s:.0f} ms")
        for field, number in ((self._lost, counts.lost), (self._dropped, counts.dropped)):
            field.setText(str(number))
            set_role(field, "bad" if number else "")
        self._sync.setText("–" if math.isnan(counts.sync_s) else f"{1e3 * counts.sync_s:.2f} ms")


def _figure() -> QLabel:
    made = QLabel("–")
    made.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
    made.setMinimumWidth(made.fontMetrics().horizontalAdvance("0 000.0 Hz"))
    return made
