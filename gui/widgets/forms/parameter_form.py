"""A form for the fields of a dataclass: one row each, in the units of the laboratory, within limits.

The unit is told by the end of a field's name, as everywhere in this program: ``step_length_m`` is entered in mm,
``angle_rad`` in degrees. The values that go in and out are in SI units.
"""

import dataclasses
import math
import types
from collections.abc import Mapping, Sequence
from typing import Any, Union, get_args, get_origin, get_type_hints

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QDoubleSpinBox, QGridLayout, QLabel, QLineEdit, QSpinBox, QWidget

from gui.widgets.cards import label

Range = tuple[float, float]

_QUANTITIES: Mapping[str, tuple[float, str, int]] = {
    "_m_s": (1e3, "mm/s", 2),
    "_rad": (math.degrees(1.0), "°", 1),
    "_s": (1.0, "s", 2),
    "_m": (1e3, "mm", 2),
}


class ParameterForm(QWidget):
    """Edits some fields of a dataclass; ``changed`` tells every change.

    Parameters
    ----------
    kind : the dataclass; the type of a field chooses its editor: int, float, or a tuple of floats
    usual : SI value of each field to be shown, in this order
    ranges : SI limits of the numbers
    """

    changed = Signal()

    def __init__(
        self,
        kind: type[Any],
        usual: Mapping[str, Any],
        ranges: Mapping[str, Range],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        hints = get_type_hints(kind)
        known = {field.name for field in dataclasses.fields(kind)}
        if unknown := set(usual) - known:
            raise ValueError(f"{kind.__name__} has no field {', '.join(sorted(unknown))}")
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(10)
        grid.setVerticalSpacing(6)
        grid.setColumnStretch(1, 1)
        self.editors: dict[str, _Number | _Numbers] = {}
        for row, (name, value) in enumerate(usual.items()):
            title, scale, unit, decimals = _told(name)
            hint = _without_none(hints[name])
            if get_origin(hint) is tuple:
                editor: _Number | _Numbers = _Numbers(value, scale, unit)
            elif hint is int:
                editor = _Number(_whole(ranges.get(name, (0, 999)), value), 1.0)
            else:
                editor = _Number(_decimal(ranges.get(name, (0.0, 1e3)), value, scale, unit, decimals), scale)
            caption = QLabel(title)
            caption.setBuddy(editor.widget)
            editor.widget.setAccessibleName(title)
            editor.connect(self.changed.emit)
            grid.addWidget(caption, row, 0)
            grid.addWidget(editor.widget, row, 1)
            grid.addWidget(label(editor.allowed, "muted"), row, 2)
            self.editors[name] = editor

    def values(self) -> dict[str, Any]:
        """Return what is entered, SI.

        Raises
        ------
        ValueError
            A list of numbers holds something else.
        """
        return {name: editor.value() for name, editor in self.editors.items()}

    def set_values(self, values: Mapping[str, Any]) -> None:
        """Enter values, SI."""
        for name, value in values.items():
            self.editors[name].set_value(value)


class _Number:
    """A spin box with its scale."""

    def __init__(self, box: QSpinBox | QDoubleSpinBox, scale: float) -> None:
        self.widget = box
        self._scale = scale
        unit = box.suffix()
        self.allowed = f"{box.minimum():g} to {box.maximum():g}{unit}"

    def value(self) -> float | int:
        shown = self.widget.value()
        return shown if isinstance(self.widget, QSpinBox) else shown / self._scale

    def set_value(self, value: float) -> None:
        if isinstance(self.widget, QSpinBox):
            self.widget.setValue(int(value))
        else:
            self.widget.setValue(value * self._scale)

    def connect(self, tell: Any) -> None:
        self.widget.valueChanged.connect(lambda _: tell())


class _Numbers:
    """Numbers with commas between them."""

    def __init__(self, value: Sequence[float], scale: float, unit: str) -> None:
        self.widget = QLineEdit()
        self.widget.setPlaceholderText("none")
        self._scale, self._unit = scale, unit
        self.allowed = f"{unit}, as 3, 8, 18"
        self.set_value(value)

    def value(self) -> tuple[float, ...]:
        parts = [part for part in self.widget.text().replace(";", ",").split(",") if part.strip()]
        try:
            return tuple(float(part) / self._scale for part in parts)
        except ValueError:
            raise ValueError(
                f"{self.widget.accessibleName()}: {self.widget.text()!r} is no list of numbers such as 3, 8, 18"
            ) from None

    def set_value(self, value: Sequence[float]) -> None:
        self.widget.setText(", ".join(f"{number * self._scale:g}" for number in value))

    def connect(self, tell: Any) -> None:
        self.widget.textChanged.connect(lambda _: tell())


def _told(name: str) -> tuple[str, float, str, int]:
    """Return title, scale, unit and decimals of a field."""
    for ending, (scale, unit, decimals) in _QUANTITIES.items():
        if name.endswith(ending):
            return name.removesuffix(ending).replace("_", " "), scale, unit, decimals
    return name.replace("_", " "), 1.0, "", 3


def _without_none(hint: Any) -> Any:
    if get_origin(hint) in (Union, types.UnionType):
        return next(kind for kind in get_args(hint) if kind is not type(None))
    return hint


def _whole(allowed: Range, value: int) -> QSpinBox:
    box = QSpinBox()
    box.setRange(int(allowed[0]), int(allowed[1]))
    box.setValue(value)
    return box


def _decimal(allowed: Range, value: float, scale: float, unit: str, decimals: int) -> QDoubleSpinBox:
    box = QDoubleSpinBox()
    box.setDecimals(decimals)
    box.setRange(allowed[0] * scale, allowed[1] * scale)
    box.setSingleStep(10.0 ** (1 - decimals) if decimals else 1.0)
    box.setValue(value * scale)
    box.setSuffix(f" {unit}" if unit else "")
    return box
