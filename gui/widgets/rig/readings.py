"""Numbers of the moment: wrench and pose, with their units."""

import math

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from daq.frames import rotation
from daq.rig import Rig
from daq.session.checks import gripper_in_tissue
from gui.rig.state import RigState
from gui.widgets.cards import label
from robot_drivers.protocols import Pose

_WRENCH = (("Fx", "N"), ("Fy", "N"), ("Fz", "N"), ("Tx", "N·m"), ("Ty", "N·m"), ("Tz", "N·m"))
_POSE = (("x", "mm"), ("y", "mm"), ("z", "mm"), ("rx", "°"), ("ry", "°"), ("rz", "°"))


class WrenchReadings(QWidget):
    """The newest wrench with its zero taken off, sensor frame."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._fields = _fields(self, _WRENCH)

    def show_state(self, state: RigState) -> None:
        """Show a state."""
        load = state.load
        for number, field in enumerate(self._fields):
            digits = 2 if number < 3 else 3
            field.setText("–" if load is None else _signed(float(load[number]), digits))


class PoseReadings(QWidget):
    """Where the gripper is from its grasp, in the axes of the tissue frame, with its rotation vector in degrees."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._fields = _fields(self, _POSE)

    def show_state(self, state: RigState, rig: Rig) -> None:
        """Show a state of this rig."""
        if state.tool is None:
            for field in self._fields:
                field.setText("–")
            return
        x, y, z, *quaternion = state.tool.tolist()
        w, i, j, k = quaternion
        gripper = gripper_in_tissue(rig, Pose((x, y, z), (w, i, j, k)))
        way_mm = 1e3 * (np.array(gripper.position) - rig.specimen.grasp.centre)
        turn_deg = np.degrees(rotation(gripper.quaternion_wxyz).as_rotvec())
        for field, value in zip(self._fields, [*way_mm.tolist(), *turn_deg.tolist()], strict=True):
            field.setText("–" if math.isnan(value) else _signed(value, 2))


def _signed(value: float, digits: int) -> str:
    """Return a number with its sign; what rounds to zero is positive."""
    return f"{round(value, digits) + 0.0:+.{digits}f}"


def _fields(parent: QWidget, channels: tuple[tuple[str, str], ...]) -> list[QLabel]:
    grid = QGridLayout(parent)
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setHorizontalSpacing(8)
    grid.setVerticalSpacing(2)
    fields = []
    for number, (name, unit) in enumerate(channels):
        row, column = number // 3, 3 * (number % 3)
        value = QLabel("–")
        value.setProperty("role", "figure")
        value.setAlignment(Qt.AlignmentFlag.AlignRight)
        value.ensurePolished()
        value.setMinimumWidth(value.fontMetrics().horizontalAdvance("+000.000"))
        grid.addWidget(label(name, "muted"), row, column)
        grid.addWidget(value, row, column + 1)
        grid.addWidget(label(unit, "muted"), row, column + 2)
        grid.setColumnStretch(column + 2, 1)
        fields.append(value)
    return fields
