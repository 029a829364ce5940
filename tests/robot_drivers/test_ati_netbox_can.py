"""The Net Box on its native CAN protocol: driver and emulated box on python-can's virtual bus."""

import itertools
import math
import struct
import time
from contextlib import contextmanager

import can
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sensor_blocks import first_block

from robot_drivers.ati.emulator import EmulatorSettings, Faults
from robot_drivers.ati.emulator.can.netbox_can import CanFaults, NetBoxCanEmulator, NetBoxCanEmulatorSettings
from robot_drivers.ati.netbox_can import NetBoxCan, NetBoxCanSettings, frames
from robot_drivers.ati.netbox_can.sample_clock import SampleClock
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import ConfigurationError, DeviceTimeoutError, DeviceUnreachableError

BASE = 0x1B0
LOAD = np.array([10.0, -20.0, 30.0, 0.1, -0.2, 0.3])
NOISELESS = EmulatorSettings(noise_std=(0.0,) * 6)
SHORT = {"answer": "short", "scale_factors": (4000.0, 4000.0, 12300.0, 400.0, 400.0, 400.0)}
_channels = (f"netbox-can-{number}" for number in itertools.count())


def settings_for(channel, **changes):
    basic = {"interface": "virtual", "bitrate": 1_000_000, "rate_hz": 200.0, "answer_timeout_s": 0.5}
    basic |= {"base": BASE, "counts_per_force": 1e6, "counts_per_torque": 1e6}
    return NetBoxCanSettings(channel=channel, **basic | changes)


@contextmanager
def connected(source=lambda _: LOAD, box=NOISELESS, **changes):
    """An emulated box with a sensor connected to it, not yet polled."""
    channel = next(_channels)
    with NetBoxCanEmulator(source, NetBoxCanEmulatorSettings(channel=channel, box=box)) as emulator:
        sensor = NetBoxCan(settings_for(channel, **changes))
        try:
            sensor.connect()
            yield emulator, sensor
        finally:
            sensor.close()


# ---- bytes


def test_the_manuals_example_number_is_little_endian_and_signed():
    answer = [bytes.fromhex("0FCFDAFD 00000000"), bytes(8), bytes(8), bytes(8)]
    assert frames.decode_long(answer, frames.LONG_ORDER).counts[0] == -35991793


def test_a_long_answer_alternates_forces_and_torques():
    answer = [
        bytes.fromhex("40420F00 64000000"),  # Fx 1000000, Tx 100
        bytes.fromhex("807BE1FF 38FFFFFF"),  # Fy -2000000, Ty -200
        bytes.fromhex("E0673500 FFFFFFFF"),  # Fz 3500000, Tz -1
        bytes.fromhex("00000280 07000000"),  # status 0x80020000, sample 7
    ]
    reading = frames.decode_long(answer, frames.LONG_ORDER)
    assert reading.counts == (1000000, -2000000, 3500000, 100, -200, -1)
    assert (reading.status, reading.sample) == (0x8002_0000, 7)


def test_the_order_of_the_long_answer_is_a_setting():
    answer = [struct.pack("<ii", 1, 2), struct.pack("<ii", 3, 4), struct.pack("<ii", 5, 6), bytes(8)]
    order = ("fx", "fy", "fz", "tx", "ty", "tz", "status", "sample")
    assert frames.decode_long(answer, order).counts == (1, 2, 3, 4, 5, 6)


def test_a_short_answer_is_two_messages_of_four_numbers():
    reading = frames.decode_short(
        [bytes.fromhex("0100 FEFF 0080 FF7F"), bytes.fromhex("0500 FAFF 0280 FFFF")]
    )
    assert reading.counts == (1, -32768, 5, -2, 32767, -6)
    assert (reading.status, reading.sample) == (0x8002, 65535)


def test_requests_are_one_byte_under_the_base_identifier():
    long, short = frames.long_request(0x100, 0x01), frames.short_request(0x100)
    assert (long.identifier, long.data) == (0x100, b"\x01")
    assert long.answers == ((0x101, 8), (0x102, 8), (0x103, 8), (0x104, 8))
    assert (short.identifier, short.data) == (0x100, b"\x02")
    assert short.answers == ((0x105, 8), (0x106, 8))
    assert frames.command(0x100, frames.BIAS).data == b"\x04"


@given(st.binary(min_size=32, max_size=32))
def test_any_long_answer_is_decoded_as_the_table_says(data):
    reading = frames.decode_long([data[k : k + 8] for k in (0, 8, 16, 24)], frames.LONG_ORDER)
    fx, tx, fy, ty, fz, tz, status, sample = struct.unpack("<6i2I", data)
    assert reading == frames.Reading((fx, fy, fz, tx, ty, tz), status, sample)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ("01", [(0x1B1, "80969800 A0860100"), (0x1B2, "00D3CEFE C0F2FCFF"), (0x1B3, "80C3C901 E0930400")]),
        ("02", [(0x1B5, "C409 FA00 78EC 0CFE")]),  # 2500, 250, -5000, -500 counts of 4000 and 400
    ],
)
def test_the_emulated_box_answers_with_the_bytes_of_the_manual(data, expected):
    channel = next(_channels)
    settings = NetBoxCanEmulatorSettings(channel=channel, box=NOISELESS)
    with (
        NetBoxCanEmulator(lambda _: LOAD, settings),
        can.Bus(interface="virtual", channel=channel) as bus,
    ):
        bus.send(can.Message(arbitration_id=BASE, data=bytes.fromhex(data), is_extended_id=False))
        received = [bus.recv(1.0) for _ in range(4 if data == "01" else 2)]
        assert bus.recv(0.05) is None
    found = [(message.arbitration_id, bytes(message.data)) for message in received]
    assert found[: len(expected)] == [(answer, bytes.fromhex(text)) for answer, text in expected]
    assert found[-1][0] == (0x1B4 if data == "01" else 0x1B6)
    assert found[-1][1][:4] == (bytes(4) if data == "01" else bytes.fromhex("8709 EE02"))


# ---- the sample number as a clock


def ticks(seconds):
    return round(seconds * 7000)


def test_a_short_sample_number_is_unwrapped_by_the_host_clock():
    clock = SampleClock(1 << 16, 7000.0)
    times = [clock.time_s((100 + ticks(s)) % 65536, round(s * 1e9)) for s in (0.0, 5.0, 12.0, 60.0)]
    assert np.diff(times) == pytest.approx([5.0, 7.0, 48.0])
    assert (clock.restarts, clock.repeated) == (0, 0)


def test_a_sample_that_was_there_before_is_told_once_only():
    clock = SampleClock(1 << 32, 7000.0)
    assert clock.time_s(7000, 0) == 1.0
    assert clock.time_s(7000, 1_000_000) is None
    assert clock.repeated == 1


@pytest.mark.parametrize("uptime_s", [0.1, 30.0])
def test_a_box_powered_up_anew_begins_a_new_epoch_even_if_its_number_has_grown(uptime_s):
    clock = SampleClock(1 << 32, 7000.0)
    before = clock.time_s(ticks(1.0), 0)
    after = clock.time_s(ticks(uptime_s), 40_000_000_000)
    later = clock.time_s(ticks(uptime_s + 2.0), 42_000_000_000)
    assert clock.restarts == 1
    assert after == 0.0 < before
    assert later == pytest.approx(2.0)


# ---- driver


@pytest.mark.parametrize("changes", [{}, SHORT], ids=["long", "short"])
def test_both_answers_give_the_load(changes):
    with connected(**changes) as (_, sensor):
        sensor.start()
        block = first_block(sensor)
    assert block.usable.all()
    resolution = 0.0125 if changes else 1e-6
    np.testing.assert_allclose(block.wrench, np.tile(LOAD, (len(block), 1)), atol=resolution)


def test_the_units_of_the_settings_scale_the_counts():
    with connected(force_unit="lbf", counts_per_torque=500_000.0) as (_, sensor):
        sensor.start()
        block = first_block(sensor)
    np.testing.assert_allclose(block.wrench[0], LOAD * ([4.4482216152605] * 3 + [2.0] * 3), rtol=1e-5)


def test_connecting_does_not_bias_and_a_bias_is_only_set_on_request():
    with connected() as (_, sensor):
        sensor.start()
        assert first_block(sensor).wrench[-1] == pytest.approx(LOAD, abs=1e-5)
        sensor.set_bias()
        assert (
            np.abs(first_block(sensor, lambda b: np.abs(b.wrench[-1]).max() < 1e-3).wrench[-1]).max() < 1e-3
        )


def test_the_latch_is_a_warning_and_can_be_cleared():
    with connected() as (emulator, sensor):
        emulator.latch_monitor_condition()
        sensor.start()
        latched = first_block(sensor, lambda block: block.status.all())
        assert latched.usable.all()
        assert set(latched.status.tolist()) == {0x8001_0000}
        sensor.reset_latch()
        first_block(sensor, lambda block: not block.status.any())
    assert sensor.describe_status(0x8001_0000)[1].startswith("bit 16: monitor condition")


@pytest.mark.parametrize("changes", [{}, SHORT], ids=["long", "short"])
def test_saturation_forbids_the_sample(changes):
    with connected(**changes) as (emulator, sensor):
        sensor.start()
        emulator.inject(Faults(saturated=True))
        assert not first_block(sensor, lambda block: block.status.all()).usable.any()


def test_a_wrench_beyond_the_rated_range_is_not_usable():
    with connected(lambda _: np.array([131.0, 0, 0, 0, 0, 0])) as (_, sensor):
        sensor.start()
        assert not first_block(sensor).usable.any()


@pytest.mark.parametrize("missing", ["silence", "halving", "cutting"])
def test_a_request_without_a_whole_answer_is_one_lost_sample(missing):
    with connected(answer_timeout_s=0.5) as (emulator, sensor):
        emulator.faults = CanFaults(**{missing: 0.1})
        emulator.counts.requests = emulator.counts.unanswered = 0
        sensor.start()
        counts = emulator.counts
        enough = iter(lambda: counts.unanswered > 0 and counts.requests > counts.unanswered + 20, True)
        blocks = [sensor.read(0.05) for _ in enough]
        sensor.stop()
        blocks.append(sensor.read(0.0))
        statistics = sensor.statistics()
    assert statistics.lost == counts.unanswered > 0
    assert statistics.received == counts.requests - counts.unanswered == sum(map(len, blocks))
    assert statistics.malformed == counts.cut
    assert np.abs(np.concatenate([block.wrench for block in blocks]) - LOAD).max() < 1e-5


def test_a_restart_of_the_box_shows_as_a_new_epoch_of_its_clock():
    with connected() as (emulator, sensor):
        sensor.start()
        before = first_block(sensor).device_time_s[-1]
        emulator.inject(Faults(restart_at_s=0.0, restart_for_s=0.8))
        after = first_block(sensor, lambda block: block.device_time_s[0] < before)
        assert sensor.statistics().restarts == 1
        assert sensor.statistics().lost > 0
        host = first_block(sensor).host_time_ns[-1] - after.host_time_ns[0]
        device = sensor.read(1.0).device_time_s[0] - after.device_time_s[0]
        assert device == pytest.approx(host * 1e-9, abs=1.0)


def leave_the_bus(emulator, gone):
    emulator.faults = CanFaults(bus_off=gone)


def pull_the_cable(emulator, gone):
    emulator.inject(Faults(unplug_at_s=0.0, unplug_for_s=math.inf) if gone else Faults())


@pytest.mark.parametrize("part", [leave_the_bus, pull_the_cable])
def test_a_box_off_the_bus_is_silent_and_serves_the_same_epoch_when_it_returns(part):
    with connected() as (emulator, sensor):
        sensor.start()
        first_block(sensor)
        part(emulator, True)
        while len(sensor.read(0.2)):
            pass
        part(emulator, False)
        assert first_block(sensor).usable.all()
        assert sensor.statistics().restarts == 0


def test_a_sample_number_of_another_rate_is_refused_with_the_rate_found():
    slow = EmulatorSettings(noise_std=(0.0,) * 6, internal_rate_hz=1000)
    with pytest.raises(ConfigurationError, match="sample_rate_hz says 7000"), connected(box=slow):
        pass
    with connected(box=slow, sample_rate_hz=1000.0) as (_, sensor):
        sensor.start()
        assert len(first_block(sensor))


def test_without_a_clock_in_the_box_the_device_time_is_that_of_the_requests():
    with connected(sample_rate_hz=0.0) as (_, sensor):
        before_ns = host_time_ns()
        sensor.start()
        first_block(sensor)
        time.sleep(0.1)
        block = first_block(sensor)
    assert (np.diff(block.device_time_s) > 0).all()
    since_start_s = (block.host_time_ns - before_ns) * 1e-9
    assert (block.device_time_s <= since_start_s).all()
    assert (since_start_s - block.device_time_s < 30.0).all()  # an answer may take long on a busy machine


def test_nobody_at_the_base_is_a_timeout_with_the_base():
    channel = next(_channels)
    with pytest.raises(DeviceTimeoutError, match=r"base 0x1b0 .* 0 of 4 frames"):
        NetBoxCan(settings_for(channel)).connect()
    with pytest.raises(DeviceUnreachableError, match="cannot be opened"):
        NetBoxCan(settings_for("no-such-can", interface="socketcan")).connect()
