"""One motion of a robot at a time."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from robot_drivers.errors import MotionRefusedError


@contextmanager
def one_motion(of_robot: threading.Lock) -> Iterator[None]:
    """Hold the lock of a robot's motions; a second motion is refused instead of waiting for the first.

    Raises
    ------
    MotionRefusedError
        Another motion is under way; nothing has moved.
    """
    if not of_robot.acquire(blocking=False):
        raise MotionRefusedError("another motion of this robot is under way; wait for it or hold")
    try:
        yield
    finally:
        of_robot.release()
