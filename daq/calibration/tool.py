"""The gripper's centre point in the frame of the flange, by turning it about a fixed point."""

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure as Plot

from daq.calibration_files.outcome import Figure, Outcome
from daq.calibration_files.results import ToolResult
from daq.errors import CalibrationError
from daq.frames import distance, rotation
from daq.rig import Rig
from robot_drivers.protocols import FloatArray, Pose

FEWEST_TOUCHES = 5
LEAST_TURN_DEG = 30.0
MOST_RMS_M = 3e-4
MOST_STD_M = 3e-4


@dataclass(frozen=True, slots=True)
class PivotFigures:
    """How it stands after a touch; ``rms_m`` is NaN until three touches determine the point."""

    touches: int
    turn_deg: float
    rms_m: float


class ToolCalibration:
    """Collects poses in which the centre of the gripper touches one fixed point, such as the tip of a pin.

    Parameters
    ----------
    T_flange_tool : the controller's tool data, in which the robot reports its poses
    """

    def __init__(self, T_flange_tool: Pose) -> None:
        self._T_flange_tool = T_flange_tool
        self._touches: list[Pose] = []

    def add(self, T_base_tool: Pose) -> PivotFigures:
        """Take the present pose for a touch of the point, and tell how it stands."""
        self._touches.append(T_base_tool)
        return self.figures

    @property
    def figures(self) -> PivotFigures:
        """How it stands."""
        rms = float("nan")
        if len(self._touches) >= 3:
            _, residuals, _ = self._solved()
            rms = float(np.sqrt(np.mean(residuals**2)))
        return PivotFigures(len(self._touches), self._turn_deg(), rms)

    def finish(self) -> Outcome[ToolResult]:
        """Find the point.

        Raises
        ------
        CalibrationError
            Fewer than three touches, or all of them in nearly one orientation.
        """
        if len(self._touches) < 3 or self._turn_deg() < 5.0:
            raise CalibrationError(
                f"tool: {len(self._touches)} touches that turn by {self._turn_deg():.1f}° do not tell the point; "
                f"touch it {FEWEST_TOUCHES} times, turned by {LEAST_TURN_DEG:g}° and more in different directions"
            )
        solution, residuals, covariance = self._solved()
        std = float(np.sqrt(np.diag(covariance)[:3].max()))
        flange = rotation(self._T_flange_tool.quaternion_wxyz).apply(solution[:3])
        result = ToolResult(
            _vector(solution[:3]), _vector(flange + np.asarray(self._T_flange_tool.position)), std
        )
        figures = (
            Figure("touches", float(len(self._touches)), "", least=float(FEWEST_TOUCHES)),
            Figure("largest turn", self._turn_deg(), "°", least=LEAST_TURN_DEG),
            Figure("touches off one point, rms", float(np.sqrt(np.mean(residuals**2))), "m", most=MOST_RMS_M),
            Figure("centre point, standard deviation", std, "m", most=MOST_STD_M),
        )

        def draw(plot: Plot) -> None:
            axes = plot.subplots()
            axes.plot(1e3 * residuals, "o-", label=("x", "y", "z"))
            axes.set(xlabel="touch", ylabel="touch less point, mm")
            axes.legend()

        return Outcome("tool", result, figures, draw)

    def _solved(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return tip in the tool frame and point in the base frame (6,), residuals (n, 3), covariance (6, 6).

        R_i t + p_i = c for every touch i, linear in t and c.
        """
        rotations = np.array([rotation(touch.quaternion_wxyz).as_matrix() for touch in self._touches])
        design = np.concatenate([rotations, np.tile(-np.eye(3), (len(rotations), 1, 1))], axis=2).reshape(
            -1, 6
        )
        right = -np.array([touch.position for touch in self._touches]).ravel()
        solution = np.linalg.lstsq(design, right, rcond=None)[0]
        residuals = design @ solution - right
        freedom = max(len(right) - 6, 1)
        covariance = float(residuals @ residuals) / freedom * np.linalg.pinv(design.T @ design)
        return solution, residuals.reshape(-1, 3), covariance

    def _turn_deg(self) -> float:
        if not self._touches:
            return 0.0
        return math.degrees(max(distance(a, b)[1] for a in self._touches for b in self._touches))


def flange_tool(rig: Rig) -> Pose:
    """Return the tool data ``T_flange_tool`` of a rig's robot, as its driver says."""
    return rig.robot_specification().T_flange_tool


def _vector(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
