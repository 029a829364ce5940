"""Faults of the emulators that their own tests do not hold: what the host sees of each."""

import itertools
import socket
import struct
import time
from contextlib import closing

import can
import numpy as np
import pytest

from robot_drivers.abb.egm.codec import decode_robot
from robot_drivers.abb.emulator.controller import ControllerEmulator
from robot_drivers.abb.emulator.settings import ArmSettings, ControllerFaults, EmulatorSettings
from robot_drivers.ati.emulator import NetFTEmulator
from robot_drivers.ati.emulator.can.netcanoem import BoardFaults, BoardSettings, NetCANOEMEmulator
from robot_drivers.ati.emulator.can.slcan_adapter import SlcanAdapterEmulator
from robot_drivers.ati.emulator.serial.digital_ft import DigitalFTEmulator
from robot_drivers.ati.netcanoem import NetCANOEM, NetCANOEMSettings
from robot_drivers.ati.netft import NetFT, NetFTSettings
from robot_drivers.cameras.emulator import CameraEmulator, CameraEmulatorSettings, CameraFaults
from robot_drivers.cameras.opencv import OpenCVCamera
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.emulated_clock import ClockError
from robot_drivers.errors import DeviceTimeoutError, DeviceUnreachableError
from robot_drivers.serial_line.emulator.line import LineFaults
from robot_drivers.serial_line.line import SerialLine

LOAD = np.zeros(6)
GAGES = can.Message(arbitration_id=0x200, is_extended_id=False)
_channels = (f"faults-{number}" for number in itertools.count())
pytest.importorskip("termios", reason="pseudo-terminals are a matter of POSIX")


# ---- CAN


@pytest.fixture
def board():
    """An emulated board and a bus to ask it over."""
    channel = next(_channels)
    with (
        NetCANOEMEmulator(lambda _: LOAD, BoardSettings(channel=channel)) as emulator,
        can.Bus(interface="virtual", channel=channel) as bus,
    ):
        yield emulator, bus


def status(bus, patience_s=1.0):
    """Ask for the gages; return the status word, None for no answer."""
    bus.send(GAGES)
    answer = bus.recv(patience_s)
    if answer is None:
        return None
    bus.recv(patience_s)
    return struct.unpack_from(">H", bytes(answer.data))[0]


def test_a_board_that_went_bus_off_is_silent_and_then_tells_of_it_until_it_is_reset(board):
    emulator, bus = board
    emulator.faults = BoardFaults(bus_off_at_s=0.0, bus_off_for_s=1.0)
    assert status(bus, 0.05) is None
    time.sleep(1.1)
    assert status(bus) == 1 << 15 | 1 << 14
    bus.send(can.Message(arbitration_id=0x20C, is_extended_id=False))
    assert status(bus) == 0


def test_a_board_that_lost_power_uses_calibration_0_again(board):
    emulator, bus = board
    bus.send(can.Message(arbitration_id=0x206, data=b"\x03", is_extended_id=False))
    assert bytes(bus.recv(1.0).data) == b"\x03"
    assert status(bus) & 1 << 6  # slot 3 is empty
    emulator.faults = BoardFaults(restart_at_s=0.0, restart_for_s=1.0)
    assert status(bus, 0.05) is None
    time.sleep(1.1)
    assert status(bus) == 0


def test_the_driver_lives_through_bus_off():
    channel = next(_channels)
    with NetCANOEMEmulator(lambda _: LOAD, BoardSettings(channel=channel)) as emulator:
        settings = NetCANOEMSettings(
            channel=channel, interface="virtual", rate_hz=100.0, answer_timeout_s=0.2
        )
        with closing(NetCANOEM(settings)) as sensor:
            sensor.connect()
            sensor.start()
            assert len(sensor.read(1.0))
            emulator.faults = BoardFaults(bus_off_at_s=0.0, bus_off_for_s=0.2)
            time.sleep(0.25)
            deadline = time.monotonic() + 60.0
            while not any(word & 1 << 14 for word in sensor.read(0.1).status) and time.monotonic() < deadline:
                pass
            assert time.monotonic() < deadline
            assert sensor.statistics().lost > 0


def test_a_serial_can_adapter_carries_frames_both_ways_and_refuses_nonsense():
    channel = next(_channels)
    with SlcanAdapterEmulator(channel) as adapter, can.Bus(interface="virtual", channel=channel) as bus:
        line = SerialLine(adapter.port, 115200, "N")
        with closing(line):
            line.write(b"t2000\r")  # not open yet
            assert line.read_exactly(1, 2.0) == b"\a"
            line.write(b"S5\rO\rt20021122\rT000002003AABBCC\rt2003AA\rtxyz\r?\r")
            assert line.read_exactly(9, 2.0) == b"\r\rz\rZ\r\a\a\a"
            standard, extended = bus.recv(1.0), bus.recv(1.0)
            assert (standard.arbitration_id, bytes(standard.data)) == (0x200, b"\x11\x22")
            assert (extended.is_extended_id, bytes(extended.data)) == (True, b"\xaa\xbb\xcc")
            bus.send(can.Message(arbitration_id=0x201, data=b"\x01\xff", is_extended_id=False))
            assert line.read_exactly(10, 2.0) == b"t201201FF\r"


# ---- serial


def test_a_delayed_line_delivers_everything_later():
    with DigitalFTEmulator(lambda _: LOAD) as device:
        device.inject(LineFaults(delay_s=0.3))
        with closing(SerialLine(device.port, 1_250_000, "E")) as line:
            begin = time.monotonic()
            line.write(bytes.fromhex("0A 6A AA FF 1D"))
            assert line.read_exactly(5, 2.0) == bytes.fromhex("0A 6A 01 BE A2")
            assert time.monotonic() - begin >= 0.3


# ---- controller


@pytest.fixture
def stream():
    """A controller that sends its position stream to a socket."""
    with (
        ControllerEmulator(EmulatorSettings(arm=ArmSettings(seed=1))) as controller,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening,
    ):
        listening.bind(("127.0.0.1", 0))
        listening.settimeout(60.0)
        controller.start_egm_stream("127.0.0.1", listening.getsockname()[1])
        yield controller, listening


def received(listening, seconds):
    end, datagrams = time.monotonic() + seconds, []
    while time.monotonic() < end:
        datagrams.append(listening.recv(4096))
    return datagrams


def test_truncated_datagrams_are_shorter_than_whole_ones(stream):
    controller, listening = stream
    whole = len(listening.recv(4096))
    controller.inject(ControllerFaults(egm_truncation=1.0))
    while len(listening.recv(4096)) >= whole:  # those that were sent before
        pass
    lengths = [len(listening.recv(4096)) for _ in range(30)]
    assert len(set(lengths)) > 10
    assert min(lengths) < whole / 2


def test_delayed_datagrams_come_late_by_the_controllers_clock(stream):
    controller, listening = stream

    def age():
        """Arrival by the host's clock minus sample time by the controller's, up to a constant."""
        time_of = decode_robot(listening.recv(4096)).feed_back.time
        return time.monotonic() - time_of.sec - 1e-6 * time_of.usec

    prompt = min(age() for _ in range(20))
    controller.inject(ControllerFaults(egm_delay_s=0.5))
    time.sleep(0.5)
    received(listening, 0.3)
    assert min(age() for _ in range(20)) - prompt > 0.4


def test_an_unplugged_controller_is_silent_and_goes_on_counting(stream):
    controller, listening = stream
    listening.recv(4096)
    controller.inject(ControllerFaults(unplug_at_s=0.0, unplug_for_s=1.5))
    listening.settimeout(0.1)
    with pytest.raises(TimeoutError):
        received(listening, 1.0)
    listening.settimeout(60.0)
    time_of = decode_robot(listening.recv(4096)).feed_back.time
    assert time_of.sec + 1e-6 * time_of.usec > 1.4


def test_a_restarted_controller_breaks_its_connections_and_begins_its_numbers_anew(stream):
    controller, listening = stream
    received(listening, 0.2)
    with socket.create_connection(("127.0.0.1", controller.command_port), timeout=2.0) as client:
        time.sleep(0.05)
        controller.inject(ControllerFaults(restart_at_s=0.0, restart_for_s=0.2))
        assert client.recv(100) == b""
    deadline = time.monotonic() + 60.0
    while decode_robot(listening.recv(4096)).header.seqno:
        assert time.monotonic() < deadline, "the numbers do not begin anew"


def test_a_controllers_clock_jumps_and_what_it_has_gained_stays(stream):
    controller, listening = stream

    def ahead():
        """The controller's clock minus the host's, up to a constant."""
        time_of = decode_robot(listening.recv(4096)).feed_back.time
        return time_of.sec + 1e-6 * time_of.usec - time.monotonic()

    before = max(ahead() for _ in range(20))
    controller.disturb_clock(5.0, 0.0)
    received(listening, 0.3)
    assert max(ahead() for _ in range(20)) - before == pytest.approx(5.0, abs=1.0)
    controller.disturb_clock(0.0, 0.0)
    received(listening, 0.3)
    assert max(ahead() for _ in range(20)) - before == pytest.approx(5.0, abs=1.0)


def test_a_clock_gains_by_its_drift_from_when_that_began():
    error = ClockError().disturbed(10.0, 2.0, 500.0)
    assert (error.at(10.0), error.at(1010.0)) == (2.0, pytest.approx(2.5))
    stopped = error.disturbed(1010.0, 0.0, 0.0)
    assert stopped.at(5000.0) == pytest.approx(2.5)


def test_the_clock_of_a_box_jumps_with_its_samples():
    with (
        NetFTEmulator(lambda _: LOAD) as box,
        closing(
            NetFT(NetFTSettings(host="127.0.0.1", rdt_port=box.rdt_port, http_port=box.http_port))
        ) as sensor,
    ):
        sensor.connect()
        sensor.start()
        before = sensor.read(5.0).device_time_s[-1]
        box.disturb_clock(0.5, 0.0)  # less than what the driver takes for a new stream
        deadline, leaps = time.monotonic() + 60.0, []
        while not leaps and time.monotonic() < deadline:
            times = np.concatenate([[before], sensor.read(1.0).device_time_s])
            leaps, before = np.diff(times)[np.diff(times) > 0.4].tolist(), times[-1]
    assert leaps == [pytest.approx(0.5, abs=0.1)]


# ---- camera


def camera(faults):
    emulator = CameraEmulator(
        lambda _: np.full((48, 64), 100, np.uint8), CameraEmulatorSettings(64, 48, fps=50.0), seed=1
    )
    emulator.inject(faults)
    return emulator


def frames_of(emulator, count):
    with closing(
        OpenCVCamera(OpenCVCameraSettings(emulator.url, embedded_info=("timestamp", "frame_counter")))
    ) as c:
        c.connect()
        frames = []
        while len(frames) < count:
            frames += c.read(3.0)
        return frames


def test_a_saturated_camera_sends_white_images_that_still_count():
    with camera(CameraFaults(saturated=True)) as emulator:
        frames = frames_of(emulator, 3)
    assert (frames[0].image[1:] == 255).all()
    assert frames[2].counter > frames[0].counter


def test_the_clock_of_a_camera_jumps_and_its_counter_does_not():
    with camera(CameraFaults()) as emulator:
        first = frames_of(emulator, 1)[0]
        emulator.disturb_clock(20.0, 0.0)
        second = frames_of(emulator, 1)[0]
    frames = second.counter - first.counter
    assert second.device_time_s - first.device_time_s == pytest.approx(20.0 + frames / 50.0, abs=0.01)


def test_a_camera_that_lost_power_counts_from_0_when_it_is_back():
    with camera(CameraFaults()) as emulator:
        time.sleep(0.5)
        before = frames_of(emulator, 1)[0].counter
        assert before > 0
        restarted_s = time.monotonic()
        emulator.inject(CameraFaults(restart_at_s=0.0, restart_for_s=0.1))
        time.sleep(0.2)
        counter = frames_of(emulator, 1)[0].counter
        assert counter <= 50.0 * (time.monotonic() - restarted_s)


def test_an_unplugged_camera_ends_its_stream_and_can_be_opened_again():
    with camera(CameraFaults()) as emulator:
        settings = OpenCVCameraSettings(emulator.url, embedded_info=("timestamp", "frame_counter"))
        with closing(OpenCVCamera(settings)) as opened:
            opened.connect()
            emulator.inject(CameraFaults(unplug_at_s=0.0, unplug_for_s=0.3))
            with pytest.raises((DeviceTimeoutError, DeviceUnreachableError)):
                while True:
                    opened.read(3.0)
        time.sleep(0.4)
        assert frames_of(emulator, 1)
