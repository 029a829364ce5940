"""The Bota sensor: its emulator, its clock, and the driver in the face of faults."""

import struct
import time
from contextlib import closing, contextmanager

import numpy as np
import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st
from sensor_blocks import first_block, gathered, read_for, read_until

from robot_drivers.bota import BotaSerial, BotaSettings
from robot_drivers.bota.emulator import BotaEmulator, BotaEmulatorSettings
from robot_drivers.bota.sample_clock import SampleClock
from robot_drivers.errors import DeviceProtocolError, DeviceUnreachableError
from robot_drivers.serial_line.emulator.line import LineFaults

LOAD = np.array([10.0, -20.0, 30.0, 0.1, -0.2, 0.3])
QUIET = (0.0,) * 6


@contextmanager
def connected(source=lambda _: LOAD, emulated=None, **settings):
    with (
        BotaEmulator(source, emulated) as emulator,
        closing(
            BotaSerial(BotaSettings(port=emulator.port, **{"start_timeout_s": 30.0, **settings}))
        ) as sensor,
    ):
        sensor.connect()
        yield emulator, sensor


@contextmanager
def streaming(source=lambda _: LOAD, emulated=None, **settings):
    with connected(source, emulated, **settings) as (emulator, sensor):
        sensor.start()
        yield emulator, sensor


def placed(clock, times_us, host_s):
    return clock.place(np.array(times_us), np.array([round(1e9 * s) for s in host_s], np.int64))


def test_gaps_and_repeats_of_the_sensors_clock_are_counted():
    clock = SampleClock(800.0)
    found = placed(clock, [0, 1250, 1250, 5000, 6250], [0, 0.00125, 0.00125, 0.005, 0.00625])
    assert found.counter.tolist() == [0, 1, 4, 5]
    assert found.index.tolist() == [0, 1, 3, 4]
    assert (clock.received, clock.lost, clock.duplicated, clock.restarts) == (4, 2, 1, 0)


def test_the_clock_goes_on_after_its_32_bits():
    clock = SampleClock(800.0)
    found = placed(clock, [2**32 - 1250, 0, 1250], [0, 0.00125, 0.0025])
    np.testing.assert_allclose(np.diff(found.device_time_s), 0.00125)
    assert clock.restarts == 0


def test_a_sensor_that_was_powered_up_again_begins_its_clock_anew():
    clock = SampleClock(800.0)
    found = placed(clock, [10_000_000, 10_001_250, 1250], [0, 0.00125, 2.0])
    assert found.counter.tolist() == [0, 1, 2]
    assert found.device_time_s[-1] == pytest.approx(0.00125)
    assert clock.restarts == 1


def test_samples_that_waited_together_do_not_make_a_restart() -> None:
    clock = SampleClock(800.0)
    found = placed(clock, [0, 1250, 3_000_000, 3_001_250], [2.0, 2.0, 2.001, 2.002])
    assert found.counter.tolist() == [0, 1, 2400, 2401]
    assert (clock.lost, clock.restarts) == (2398, 0)


def test_what_waited_on_the_line_is_not_taken_for_new():
    with BotaEmulator(lambda _: LOAD) as emulator:
        time.sleep(1.5)
        with closing(BotaSerial(BotaSettings(port=emulator.port, start_timeout_s=30.0))) as sensor:
            sensor.connect()
            sensor.start()
            blocks = read_for(sensor, 0.5)
            assert sensor.statistics().lost == 0
    assert blocks[0].device_time_s[0] > 1.0
    assert len(gathered(blocks, "counter")) < 800


@given(st.lists(st.integers(1, 40), min_size=1, max_size=50), st.floats(100.0, 1000.0))
def test_counters_are_the_samples_that_the_clock_tells_of(steps, rate_hz):
    true = np.cumsum([0, *steps])
    times_s = true / rate_hz
    clock = SampleClock(rate_hz)
    found = placed(clock, np.rint(times_s * 1e6).astype(np.int64), times_s)
    assert found.counter.tolist() == true.tolist()
    assert clock.lost == true[-1] + 1 - len(true)


# ---- the emulator, over a plain port


@contextmanager
def plain(**settings):
    with (
        BotaEmulator(lambda _: LOAD, BotaEmulatorSettings(**settings)) as emulator,
        serial.Serial(emulator.port, 460800, timeout=30.0) as port,
    ):
        # opening a port throws away what has come before: the sensor is switched on once more
        emulator.inject(LineFaults(restart_at_s=0.0))
        yield port


def test_it_greets_and_streams_and_takes_the_commands_of_the_makers_example():
    with plain() as port:
        assert port.read_until(b"App Init").endswith(b"App Init")
        port.write(b"C")
        assert port.read_until(b"r,0,C,0").endswith(b"r,0,C,0")
        time.sleep(0.1)
        port.reset_input_buffer()
        port.write(b"f,512,0,0,1")
        assert port.read(7) == b"r,0,f,0"
        port.write(b"c,0,0,0,4")
        assert port.read(7) == b"r,0,c,0"
        port.write(b"R")
        assert port.read(7) == b"r,0,R,0"
        content = port.read(3 * 37)
    first, second = struct.unpack_from("<I", content, 27)[0], struct.unpack_from("<I", content, 64)[0]
    assert second - first == 10_000
    assert struct.unpack_from("<H", content, 1) == (8,)  # not calibrated


# ---- the driver


def test_nothing_is_ever_sent():
    with streaming() as (emulator, sensor):
        heard = []
        emulator._model.hear = lambda data, _: heard.append(data) or b""
        read_for(sensor, 0.1)
        sensor.stop()
        sensor.start()
        read_for(sensor, 0.1)
        sensor.close()
    assert heard == []


@pytest.mark.parametrize("sinc_length", [64, 128, 512])
def test_the_rate_is_measured_by_the_sensors_clock(sinc_length):
    with connected(emulated=BotaEmulatorSettings(sinc_length=sinc_length)) as (_, sensor):
        assert sensor.identity.details["rate"] == f"{51200 / sinc_length:.6g} Hz (measured)"
        assert sensor.identity.details["temperature"] == "31.5 °C"
        assert sensor.identity.details["status"] == "healthy"


def test_a_clock_that_runs_fast_is_told_as_it_runs():
    with streaming(emulated=BotaEmulatorSettings(clock_ppm=20_000.0)) as (_, sensor):
        times = gathered(read_for(sensor, 0.3), "device_time_s")
    assert np.median(np.diff(times)) == pytest.approx(0.00125 * 1.02)


@pytest.mark.parametrize("status", [1, 2, 4, 8, 0x8000])
def test_a_sample_with_any_status_is_not_usable(status):
    with streaming(emulated=BotaEmulatorSettings(status=status)) as (_, sensor):
        block = sensor.read(5.0)
        assert (block.status == status).all()
        assert not block.usable.any()


def test_out_of_range_is_what_the_sensor_tells_and_what_the_rig_file_says():
    beyond = np.array([0, 0, 1300.0, 0, 0, 0])
    with streaming(lambda _: beyond) as (_, sensor):
        assert not sensor.read(5.0).usable.any()
    with streaming(rated_wrench=(15.0, 15.0, 100.0, 1.0, 1.0, 1.0)) as (_, sensor):
        block = sensor.read(5.0)
        assert not block.status.any()
        assert not block.usable.any()


def test_what_is_no_number_is_not_usable():
    with streaming(lambda _: np.array([0, np.nan, 0, 0, 0, 0])) as (_, sensor):
        assert not sensor.read(5.0).usable.any()


@pytest.mark.parametrize(
    "faults",
    [LineFaults(loss=1e-3), LineFaults(corruption=1e-3), LineFaults(insertion=1e-3), LineFaults(rubbish=0.2)],
)
def test_damage_on_the_line_costs_samples_and_alters_none(faults):
    with streaming(emulated=BotaEmulatorSettings(noise_std=QUIET)) as (emulator, sensor):
        emulator.inject(faults)
        blocks = read_for(sensor, 1.0)
        found = sensor.statistics()
        assert found.malformed > 0
        counters = gathered(blocks, "counter")
        assert found.lost == counters[-1] + 1 - found.received
        assert found.lost > 0 or faults.rubbish  # rubbish comes between frames
    np.testing.assert_array_equal(
        gathered(blocks, "wrench").astype(np.float32), np.float32([LOAD] * len(counters))
    )
    np.testing.assert_allclose(
        np.diff(gathered(blocks, "device_time_s")), 0.00125 * np.diff(counters), atol=1e-9
    )


def test_a_cable_that_was_out_costs_the_samples_meanwhile():
    with streaming() as (emulator, sensor):
        first_block(sensor)
        emulator.inject(LineFaults(unplug_at_s=0.0, unplug_for_s=0.5))
        time.sleep(0.2)
        read_until(sensor, lambda: sensor.statistics().lost > 0)
        assert sensor.statistics().lost == emulator.counts.unplugged / 37
        assert sensor.statistics().restarts == 0


def test_a_sensor_that_lost_power_comes_back_by_itself():
    with streaming() as (emulator, sensor):
        time.sleep(1.0)
        first_block(sensor)
        emulator.inject(LineFaults(restart_at_s=0.0, restart_for_s=0.3))
        read_until(sensor, lambda: sensor.statistics().restarts == 1)
        assert first_block(sensor).device_time_s[0] < 1.0


def test_what_is_no_bota_sensor_is_told():
    with (
        BotaEmulator(lambda _: LOAD, BotaEmulatorSettings(binary=False)) as emulator,
        closing(BotaSerial(BotaSettings(port=emulator.port, start_timeout_s=0.5))) as sensor,
        pytest.raises(DeviceProtocolError, match="sends text: set it to binary"),
    ):
        sensor.connect()
    with BotaEmulator(lambda _: LOAD) as emulator:
        emulator.inject(LineFaults(corruption=0.5))
        with (
            closing(BotaSerial(BotaSettings(port=emulator.port, start_timeout_s=0.5))) as sensor,
            pytest.raises(DeviceProtocolError, match="no frames of a Bota sensor"),
        ):
            sensor.connect()
        emulator.inject(LineFaults(restart_at_s=0.0, restart_for_s=60.0))
        time.sleep(0.1)
        with (
            closing(BotaSerial(BotaSettings(port=emulator.port, start_timeout_s=0.3))) as sensor,
            pytest.raises(DeviceUnreachableError, match="check power"),
        ):
            sensor.connect()


def test_a_port_that_is_gone_is_told():
    with pytest.raises(DeviceUnreachableError, match="/dev/nowhere"):
        BotaSerial(BotaSettings(port="/dev/nowhere")).connect()
