"""The emulated controller at its wire, spoken to with literal bytes instead of the driver."""

import contextlib
import math
import socket
import struct
import time

import numpy as np
import pytest

from robot_drivers.abb.emulator.arm import CYCLE_S, Arm, Motion
from robot_drivers.abb.emulator.controller import ControllerEmulator
from robot_drivers.abb.emulator.settings import ArmSettings, EmulatorSettings
from robot_drivers.protocols import Pose

HELLO, GET_STATE, IDENTIFY, SET_LIMITS, MOVE_L, STOP, RESUME = range(1, 8)
ACCEPTED, DONE, REJECTED, ABORTED = 101, 102, 103, 104
OUT_OF_SEQUENCE, BUSY, HOLDING, BAD_TARGET, BAD_LIMITS, WATCHDOG, MOTION_ERROR = 2, 3, 4, 6, 11, 13, 14
HOLDING_BIT, WATCHDOG_BIT, ERROR_BIT = 8, 16, 32
OTHER = 4_000_001
PATIENCE_S = 30.0
STANDING_CYCLES = 5


class Client:
    """A bare TCP client that packs its own frames."""

    def __init__(self, emulator):
        self.socket = socket.create_connection(("127.0.0.1", emulator.command_port), timeout=PATIENCE_S)

    def send(self, command, seq, numbers=()):
        padded = [*numbers, *[0.0] * (12 - len(numbers))]
        self.socket.sendall(struct.pack("<4I12f", 60, seq, command, 0, *padded))

    def receive(self):
        """Return (seq, kind, status, code, detail)."""
        frame = b""
        while len(frame) < 80:
            received = self.socket.recv(80 - len(frame))
            assert received, "the connection was closed"
            frame += received
        _, seq, kind, status, code, detail = struct.unpack_from("<4I2f", frame)
        return seq, kind, status, code, detail

    def move(self, seq, x=450.0, y=0.0, z=350.0, speed=50.0, quaternion=(0.0, 0.0, 1.0, 0.0)):
        self.send(MOVE_L, seq, (x, y, z, *quaternion, speed, 20.0))
        return self.receive()

    def request(self, command, numbers=()):
        self.send(command, OTHER, numbers)
        return self.receive()

    def next_of(self, wanted):
        """Return the next reply to the request ``wanted``."""
        while (reply := self.receive())[0] != wanted:
            pass
        return reply


@contextlib.contextmanager
def client_of(emulator):
    client = Client(emulator)
    try:
        yield client
    finally:
        client.socket.close()


@pytest.fixture
def emulator():
    """A controller whose watchdog leaves a busy machine its time."""
    with ControllerEmulator(EmulatorSettings(watchdog_s=PATIENCE_S)) as emulator:
        yield emulator


@pytest.fixture
def client(emulator):
    with client_of(emulator) as client:
        yield client


def wait_for_cycles(emulator, count):
    """Wait until the controller has gone through so many further cycles."""
    begin_ns = emulator.path()[-1][0]
    while sum(time_ns > begin_ns for time_ns, _ in emulator.path()) < count:
        time.sleep(0.005)


def wait_for_standstill(emulator):
    while len({pose for _, pose in list(emulator.path())[-STANDING_CYCLES:]}) > 1:
        wait_for_cycles(emulator, 1)


def test_a_move_is_accepted_and_done(emulator, client):
    assert client.move(1, x=455.0)[:2] == (1, ACCEPTED)
    assert client.receive()[:2] == (1, DONE)
    assert emulator.pose().position == pytest.approx((0.455, 0.0, 0.35), abs=1e-4)


def test_a_repeated_move_is_answered_again_and_moves_nothing(emulator, client):
    client.move(1, x=455.0)
    client.receive()
    stood_at = emulator.pose()
    assert client.move(1, x=465.0)[:2] == (1, DONE)
    wait_for_cycles(emulator, STANDING_CYCLES)
    assert emulator.pose() == stood_at


def test_a_move_repeated_while_under_way_is_done_once(emulator, client):
    client.move(1, x=455.0, speed=5.0)
    assert client.move(1, x=455.0, speed=5.0)[:2] == (1, ACCEPTED)
    assert client.receive()[:2] == (1, DONE)
    assert client.request(GET_STATE)[:2] == (OTHER, DONE)


@pytest.mark.parametrize("seq", [0, 2, 7, 4_000_000])
def test_a_number_that_does_not_follow_is_rejected(emulator, client, seq):
    assert client.move(seq, x=455.0)[1::2] == (REJECTED, OUT_OF_SEQUENCE)
    wait_for_cycles(emulator, STANDING_CYCLES)
    assert emulator.pose().position == (0.45, 0.0, 0.35)


def test_a_second_move_during_the_first_is_rejected(client):
    client.move(1, x=460.0, speed=1.0)
    _, kind, _, code, _ = client.move(2, x=440.0)
    assert (kind, code) == (REJECTED, BUSY)


def test_a_client_that_falls_silent_is_stopped_by_the_watchdog():
    with ControllerEmulator(EmulatorSettings(watchdog_s=0.5)) as emulator, client_of(emulator) as client:
        started = time.monotonic()
        client.move(1, x=490.0, speed=5.0)
        _, kind, status, code, _ = client.receive()
        assert time.monotonic() - started > 0.49
        assert (kind, code) == (ABORTED, WATCHDOG)
        assert status & HOLDING_BIT
        assert status & WATCHDOG_BIT
        stood_at = emulator.pose()
        wait_for_cycles(emulator, STANDING_CYCLES)
        assert emulator.pose() == stood_at
        assert stood_at.position[0] < 0.489


def test_a_client_that_dies_is_noticed_at_once_and_its_successor_hears_nothing_of_it(emulator):
    with client_of(emulator) as first:
        first.move(1, x=490.0, speed=2.0)
        wait_for_cycles(emulator, 20)
    wait_for_cycles(emulator, 20)
    wait_for_standstill(emulator)
    assert 0.45 < emulator.pose().position[0] < 0.489
    with client_of(emulator) as second:
        seq, kind, status, _, _ = second.request(HELLO)
        assert (seq, kind) == (OTHER, DONE)
        assert status & HOLDING_BIT
        assert second.move(2)[3] == HOLDING
        assert second.request(RESUME)[1] == DONE
        assert second.move(2)[:2] == (2, ACCEPTED)
        assert second.receive()[:2] == (2, DONE)


def test_stop_is_accepted_at_once_and_done_at_standstill(emulator, client):
    client.move(1, x=490.0, speed=5.0)
    wait_for_cycles(emulator, 20)
    client.send(STOP, OTHER)
    assert client.receive()[:2] == (OTHER, ACCEPTED)
    replies = [client.receive()[:2], client.receive()[:2]]
    assert replies == [(1, ABORTED), (OTHER, DONE)]
    stood_at = emulator.pose()
    wait_for_cycles(emulator, STANDING_CYCLES)
    assert emulator.pose() == stood_at


def test_resume_before_standstill_is_rejected(client):
    client.move(1, x=490.0, speed=50.0)
    stop_and_resume = (
        struct.pack("<4I12f", 60, seq, command, 0, *[0.0] * 12)
        for seq, command in ((OTHER, STOP), (OTHER + 1, RESUME))
    )
    client.socket.sendall(b"".join(stop_and_resume))
    assert client.next_of(OTHER + 1)[1::2] == (REJECTED, BUSY)


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_a_target_without_numbers_is_rejected(emulator, client, number):
    assert client.move(1, y=number)[1] == REJECTED
    assert client.move(1, quaternion=(number, 0.0, 1.0, 0.0))[1] == REJECTED
    assert client.move(1, speed=number)[1] == REJECTED
    wait_for_cycles(emulator, STANDING_CYCLES)
    assert emulator.pose().position == (0.45, 0.0, 0.35)


def test_a_quaternion_that_is_none_is_rejected(client):
    assert client.move(1, quaternion=(0.5, 0.0, 0.5, 0.0))[3] == BAD_TARGET


def test_limits_can_be_narrowed_but_not_widened(client):
    assert client.request(SET_LIMITS, (0, -900, -900, 900, 900, 900, 900, 180, 900, 900))[1] == DONE
    assert client.move(1, x=551.0)[1] == REJECTED
    assert client.request(SET_LIMITS, (440, -10, 340, 460, 10, 360, 5, 10, 50, 20))[1] == DONE
    assert client.move(1, x=456.0)[1] == REJECTED
    assert client.move(1, x=454.0)[1] == ACCEPTED


@pytest.mark.parametrize(
    "numbers",
    [
        (900, -10, 340, 950, 10, 360, 5, 10, 50, 20),
        (440, -10, 340, 460, 10, 360, 0, 10, 50, 20),
        (440, -10, 340, 460, 10, 360, math.nan, 10, 50, 20),
    ],
    ids=["no room", "no step", "no number"],
)
def test_limits_that_allow_nothing_are_rejected(client, numbers):
    assert client.request(SET_LIMITS, numbers)[1::2] == (REJECTED, BAD_LIMITS)


def test_a_line_that_the_arm_cannot_follow_is_aborted_on_its_way():
    settings = EmulatorSettings(arm=ArmSettings(home=Pose((0.725, 0.0, 0.60), (0.0, 0.0, 1.0, 0.0))))
    with ControllerEmulator(settings) as emulator, client_of(emulator) as client:
        assert client.move(1, x=750.0, z=600.0, speed=200.0)[1] == ACCEPTED
        _, kind, status, code, _ = client.receive()
        assert (kind, code) == (ABORTED, MOTION_ERROR)
        assert status & ERROR_BIT
        assert emulator.pose().position[0] == pytest.approx(0.7405, abs=0.002)


def test_a_frame_of_another_length_ends_the_connection(client):
    client.socket.sendall(struct.pack("<4I12f", 59, 1, GET_STATE, 0, *[0.0] * 12))
    assert client.socket.recv(80) == b""


def test_requests_may_arrive_in_pieces_and_in_heaps(client):
    frame = struct.pack("<4I12f", 60, OTHER, GET_STATE, 0, *[0.0] * 12)
    for piece in (frame[:10], frame[10:] + frame * 3):
        client.socket.sendall(piece)
        time.sleep(0.02)
    assert [client.receive()[:2] for _ in range(4)] == [(OTHER, DONE)] * 4


def test_an_unknown_command_is_rejected(client):
    assert client.request(99)[1:4:2] == (REJECTED, 1)


def test_reported_numbers_are_single_precision(emulator, client):
    with socket.create_connection(("127.0.0.1", emulator.state_port), timeout=3.0) as state:
        frame = state.recv(80, socket.MSG_WAITALL)
    assert len(frame) == 80
    assert struct.unpack_from("<3f", frame, 24) == pytest.approx((450.0, 0.0, 350.0), abs=0.01)


def run_line(arm, target, linear_speed):
    arm.start_line(target, linear_speed, angular_speed=1.0, landing_offset=(0.0, 0.0, 0.0))
    positions = [arm.planned.position]
    while arm.motion is Motion.MOVING:
        arm.step()
        positions.append(arm.planned.position)
    return np.array(positions)


def test_a_line_has_a_trapezoidal_speed_profile():
    settings = ArmSettings(linear_acceleration=0.5)
    positions = run_line(Arm(settings), Pose((0.49, 0.0, 0.35), (0.0, 0.0, 1.0, 0.0)), linear_speed=0.05)
    speed = np.diff(positions[:, 0]) / CYCLE_S
    acceleration = np.diff(speed) / CYCLE_S
    assert speed.max() == pytest.approx(0.05)
    assert np.abs(acceleration[:-1]).max() < 0.5 + 1e-9  # the last step takes what is left
    assert len(positions) * CYCLE_S == pytest.approx(0.04 / 0.05 + 0.05 / 0.5, abs=0.02)
    assert positions[-1] == pytest.approx((0.49, 0.0, 0.35))
    assert np.abs(positions[:, 1:] - (0.0, 0.35)).max() < 1e-12


def test_the_true_pose_repeats_within_the_repeatability_and_the_encoders_do_not_see_it():
    arm = Arm(ArmSettings(repeatability_std=1e-5, seed=4))
    there, back = Pose((0.46, 0.0, 0.35), (0.0, 0.0, 1.0, 0.0)), Pose((0.45, 0.0, 0.35), (0.0, 0.0, 1.0, 0.0))
    errors, reported = [], []
    for _ in range(100):
        run_line(arm, there, 1.0)
        errors.append(np.subtract(arm.actual.position, there.position))
        reported.append(np.divide(arm.measure().position_mm, 1e3) - there.position)
        run_line(arm, back, 1.0)
    assert np.std(errors) == pytest.approx(1e-5, rel=0.1)
    assert np.std(reported) < 3e-6


def test_the_same_seed_gives_the_same_arm():
    def landing(seed):
        arm = Arm(ArmSettings(seed=seed))
        run_line(arm, Pose((0.46, 0.0, 0.35), (0.0, 0.0, 1.0, 0.0)), 1.0)
        return arm.actual, arm.measure()

    assert landing(1) == landing(1)
    assert landing(1) != landing(2)
