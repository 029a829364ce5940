"""The numbers by which the RAPID server of ``rapid/`` is asked, and by which it tells what became of it."""

from enum import IntEnum, IntFlag


class Command(IntEnum):
    """What a request asks for."""

    HELLO = 1
    GET_STATE = 2
    IDENTIFY = 3
    SET_LIMITS = 4
    MOVE_L = 5
    STOP = 6
    RESUME = 7


class ReplyKind(IntEnum):
    """What became of a request."""

    ACCEPTED = 101
    DONE = 102
    REJECTED = 103
    ABORTED = 104
    TEXT = 105


class Code(IntEnum):
    """Why; ``detail`` is in brackets."""

    OK = 0
    UNKNOWN_COMMAND = 1
    OUT_OF_SEQUENCE = 2
    BUSY = 3
    HOLDING = 4
    NOT_READY = 5
    BAD_TARGET = 6
    STEP_TOO_LONG = 7  # [mm]
    TURN_TOO_LARGE = 8  # [°]
    OUTSIDE_WORKSPACE = 9  # [axis 1, 2, 3]
    TOO_FAST = 10  # [1 linear, 2 angular]
    BAD_LIMITS = 11
    STOPPED = 12
    WATCHDOG = 13
    MOTION_ERROR = 14  # [ERRNO]
    PROGRAM_STOPPED = 15


CAUSES = {
    Code.OUT_OF_SEQUENCE: "its number does not follow that of the last motion; connect again",
    Code.BUSY: "another motion is under way",
    Code.HOLDING: "the controller is holding; call resume()",
    Code.NOT_READY: "motors are off or the motion program is stopped; start it on the pendant",
    Code.BAD_TARGET: "the controller takes the target for no pose",
    Code.STEP_TOO_LONG: "the step of {detail:.2f} mm is longer than the controller allows",
    Code.TURN_TOO_LARGE: "the turn of {detail:.2f}° is larger than the controller allows",
    Code.OUTSIDE_WORKSPACE: "the target leaves the controller's workspace (axis {detail:.0f} of x, y, z)",
    Code.TOO_FAST: "the speed ({detail:.0f} of linear, angular) is above the controller's cap",
    Code.BAD_LIMITS: "the limits leave no room within those installed on the controller",
    Code.STOPPED: "it was stopped by hold()",
    Code.WATCHDOG: "the controller's watchdog missed the heartbeat",
    Code.MOTION_ERROR: "the controller could not carry it out (ERRNO {detail:.0f}); see its event log",
    Code.PROGRAM_STOPPED: "the controller stopped its motion program; see its event log",
}
"""Why a request was not carried out and what to do; with a place for ``detail``."""


class Status(IntFlag):
    """State bits of the controller."""

    MOTORS_ON = 1
    PROGRAM_RUNNING = 2
    MOVING = 4
    HOLDING = 8
    WATCHDOG_TRIPPED = 16
    MOTION_ERROR = 32
