"""The person at the virtual rig: shows the board to the cameras and jogs the robot, as the prompts ask."""

from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np
from scipy.spatial.transform import Rotation

from daq.errors import SessionError
from daq.frames import pose, rotation
from daq.rig import Vector
from daq.virtual_rig.layout import FRAMES, REST_TOOL
from daq.vision.charuco import CharucoBoard
from robot_drivers.protocols import Pose

BOARD = CharucoBoard()
BOARD_VIEWS = 20
TOUCHES = 9

BOARD_AT_REST = pose((0.032, 0.044, 0.005), Rotation.from_matrix([[0, -1, 0], [-1, 0, 0], [0, 0, -1]]))
"""Where the board lies flat on the phantom in the first view, ``T_tissue_board``."""

_ANSWER_TIMEOUT_S = 30.0
_TOUCH_ERROR_M = 5e-5
_TILT = np.radians(20.0)


@dataclass(frozen=True, slots=True)
class ShowBoard:
    """Order to hold the board at ``T_tissue_board``; None to put it away."""

    T_tissue_board: Pose | None


@dataclass(frozen=True, slots=True)
class Jog:
    """Order to jog the tool to ``T_base_tool``."""

    T_base_tool: Pose


class VirtualOperator:
    """Gives orders to the process of the emulators."""

    def __init__(self, control: Connection) -> None:
        self._control = control

    def show_board(self, number: int) -> bool:
        """Show view ``number``, from 0; return False, and put the board away, when there are no more."""
        self._order(ShowBoard(board_pose(number) if number < BOARD_VIEWS else None))
        return number < BOARD_VIEWS

    def touch_point(self, number: int) -> bool:
        """Touch the pin in orientation ``number``, from 0; return False, back at rest, when there are no more."""
        self._order(Jog(touching_pose(number) if number < TOUCHES else REST_TOOL))
        return number < TOUCHES

    def _order(self, order: ShowBoard | Jog) -> None:
        self._control.send(order)
        if not self._control.poll(_ANSWER_TIMEOUT_S):
            raise SessionError("the virtual rig does not answer; the computer is too busy")
        self._control.recv()


def board_pose(number: int) -> Pose:
    """Return ``T_tissue_board`` of a view: flat at rest first, then tilted in all corners of the field."""
    if number == 0:
        return BOARD_AT_REST
    rng = np.random.default_rng(number)
    across = np.array([(-1, 0, 1)[number % 3] * 0.035, (-1, 0, 1)[number // 3 % 3] * 0.055, 0.02])
    tilt = Rotation.from_rotvec([*rng.uniform(-0.6, 0.6, 2), rng.uniform(-0.4, 0.4)])
    turn = rotation(BOARD_AT_REST.quaternion_wxyz) * tilt
    middle = np.array([BOARD.columns * BOARD.square_m / 2, BOARD.rows * BOARD.square_m / 2, 0.0])
    return pose(across + rng.uniform(-0.008, 0.008, 3) - turn.apply(middle), turn)


def touching_pose(number: int, gripper_in_tool_m: Vector = FRAMES.T_tool_gripper.position_m) -> Pose:
    """Return ``T_base_tool`` in which the gripper's centre touches the pin, nearly."""
    rng = np.random.default_rng((number, 7))
    rest = rotation(REST_TOOL.quaternion_wxyz)
    pin = np.array(REST_TOOL.position) + rest.apply(gripper_in_tool_m)
    angle = 2.4 * number  # golden angle: no two directions alike
    tilt = _TILT * min(number, 1) * np.array([np.cos(angle), np.sin(angle), 0.3])
    turn = Rotation.from_rotvec(tilt) * rest
    return pose(pin - turn.apply(gripper_in_tool_m) + rng.normal(0.0, _TOUCH_ERROR_M, 3), turn)
