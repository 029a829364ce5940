"""Motions of an emulated arm that tests begin, watch and compare."""

import contextlib
import threading
import time

from robot_drivers.errors import DeviceError
from robot_drivers.protocols import Pose


def wait_until(condition, timeout_s=60.0):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.005)


@contextlib.contextmanager
def moving(robot, target, speed):
    """A motion in another thread, already under way; gives the list that will hold how it ended."""
    outcome = []

    def move():
        try:
            outcome.append(robot.move_linear(target, speed, timeout_s=60.0))
        except DeviceError as error:
            outcome.append(error)

    thread = threading.Thread(target=move)
    thread.start()
    wait_until(lambda: robot.state().moving or outcome)
    try:
        yield outcome
    finally:
        thread.join()


def stands(emulator):
    """Whether the arm keeps its place for a while (12 cycles)."""
    before = emulator.pose()
    time.sleep(0.05)
    return emulator.pose() == before


def shifted(pose, dx=0.0, dy=0.0, dz=0.0):
    x, y, z = pose.position
    return Pose((x + dx, y + dy, z + dz), pose.quaternion_wxyz)
