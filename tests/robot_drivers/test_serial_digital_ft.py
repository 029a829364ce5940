"""The Digital F/T: its bytes, its emulator, and the driver in the face of faults."""

import struct
import time
from contextlib import closing, contextmanager

import numpy as np
import pytest
import serial
from sensor_blocks import ANSWER_TIMEOUT_S, gathered, read_for, read_until

from robot_drivers.ati.digital_ft import DigitalFT, DigitalFTSettings
from robot_drivers.ati.digital_ft.protocol import STATUS_MAP, calibration_register, parse_calibration
from robot_drivers.ati.emulator.serial.digital_ft import (
    DigitalFTEmulator,
    DigitalFTEmulatorSettings,
    calibration_record,
)
from robot_drivers.ati.transducer.gages import FT33206
from robot_drivers.errors import (
    DeviceError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)
from robot_drivers.serial_line.emulator.device import SerialDeviceEmulator
from robot_drivers.serial_line.emulator.line import LineFaults, TcpPort

LOAD = np.array([10.0, -20.0, 30.0, 0.1, -0.2, 0.3])
NOISE = np.array([0.006, 0.006, 0.0132, 0.00032, 0.00032, 0.00023])
START, STARTED = bytes.fromhex("0A 46 55 A3 9D"), bytes.fromhex("0A 46 01 A2 62")
UNLOCK, UNLOCKED = bytes.fromhex("0A 6A AA FF 1D"), bytes.fromhex("0A 6A 01 BE A2")
JAM = bytes(range(1, 15))
# between one and two samples: one in 128 bursts as long as a sample is one, with a checksum that no receiver can doubt
RUBBISH_BYTES = (14, 25)


def record_of_ft33206():
    """The calibration record as the register table says, value by value."""
    record = bytearray(2 * 168)
    for register, layout, values in [
        (0, "8s", [b"FT33206"]),
        (4, "32s", [b"SI-130-10"]),
        (20, "4s", [b"Net"]),
        (22, "20s", [b"2021-01-1905:00:00Z"]),
        (32, "36f", FT33206.matrix.ravel()),
        (104, "BB", [2, 3]),
        (105, "6f", [130, 130, 400, 10, 10, 10]),
        (117, "ii", [1_000_000, 1_000_000]),
        (121, "6H", [543, 555, 569, 579, 565, 567]),
        (127, "6H", [34927, 33031, 32120, 32868, 32234, 31842]),
    ]:
        struct.pack_into(">" + layout, record, 2 * register, *values)
    return bytes(record)


def settings_of(emulator, **settings):
    return DigitalFTSettings(**{"port": emulator.port, "answer_timeout_s": ANSWER_TIMEOUT_S, **settings})


@contextmanager
def connected(source=lambda _: LOAD, transducer=None, **settings):
    """An emulated transducer with a sensor connected to it, not yet streaming."""
    with (
        DigitalFTEmulator(source, transducer) as emulator,
        closing(DigitalFT(settings_of(emulator, **settings))) as sensor,
    ):
        sensor.connect()
        yield emulator, sensor


@contextmanager
def streaming(source=lambda _: LOAD, transducer=None, **settings):
    with connected(source, transducer, **settings) as (emulator, sensor):
        sensor.start()
        yield emulator, sensor


@contextmanager
def wired_to(emulator):
    """A bare serial port to the emulator; a pseudo-terminal minds neither bit rate nor parity."""
    with serial.Serial(emulator.port, 115200, timeout=2.0) as port:
        yield port


def test_the_calibration_record_is_read_as_the_register_table_says():
    calibration = parse_calibration(record_of_ft33206())
    np.testing.assert_allclose(calibration.matrix, FT33206.matrix, rtol=1e-7)
    for name in ("serial", "part_number", "scaling", "rated_wrench", "gains", "offsets"):
        assert getattr(calibration, name) == getattr(FT33206, name)


def test_the_emulator_keeps_the_same_record():
    assert calibration_record(FT33206) == record_of_ft33206()


@pytest.mark.parametrize(("index", "register"), [(1, 0x00E3), (2, 0x00E3 + 192), (16, 0x00E3 + 15 * 192)])
def test_calibrations_lie_192_registers_apart(index, register):
    assert calibration_register(index) == register


def test_an_empty_slot_is_no_calibration():
    with pytest.raises(DeviceProtocolError, match="calibration_index"):
        parse_calibration(bytes(336))
    with pytest.raises(DeviceProtocolError, match="100 bytes"):
        parse_calibration(record_of_ft33206()[:100])


def test_the_status_word_is_told_in_words():
    assert STATUS_MAP.describe(0x2001) == (
        "bit 13: DAC reading out of range",
        "bit 0: restarted by its watchdog",
    )


def test_the_emulator_answers_the_known_requests_with_the_known_bytes():
    with DigitalFTEmulator(lambda _: LOAD) as emulator, wired_to(emulator) as port:
        port.write(UNLOCK)
        assert port.read(5) == UNLOCKED
        port.write(START)
        assert port.read(5) == STARTED
        sample = port.read(13)
        assert sum(sample[:12]) & 0x7F == sample[12]


def test_the_emulator_streams_until_fourteen_bytes_arrive():
    with DigitalFTEmulator(lambda _: LOAD) as emulator, wired_to(emulator) as port:
        port.write(START)
        port.read(5 + 13)
        port.write(JAM[:13])
        assert len(port.read(13 * 700)) == 13 * 700
        time.sleep(0.1)
        port.write(JAM)
        while port.read(4096):
            pass
        port.write(START)
        assert port.read(5) == STARTED


def test_the_emulator_writes_only_to_unlocked_storage():
    write = bytes.fromhex("0A 10 00 00 00 01 02 01 00")
    with DigitalFTEmulator(lambda _: LOAD) as emulator, wired_to(emulator) as port:
        port.write(with_crc(write))
        assert port.read(5)[1] == 0x90
        port.write(UNLOCK)
        assert port.read(5) == UNLOCKED
        port.write(with_crc(write))
        assert port.read(8)[:6] == write[:6]


def with_crc(frame):
    crc = 0xFFFF
    for byte in frame:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 * (crc & 1))
    return frame + struct.pack("<H", crc)


def test_the_sensor_tells_what_its_calibration_says():
    with connected() as (emulator, sensor):
        identity = sensor.identity
    assert (identity.model, identity.serial) == ("ATI Digital F/T SI-130-10", "FT33206")
    assert emulator.port in identity.address
    assert identity.details["status"] == "healthy"


def test_seven_thousand_samples_a_second_arrive():
    with streaming() as (_, sensor):
        for _ in range(20):  # a busy machine now and then holds the emulated device up
            sensor.read(1.0)
            begin = time.monotonic()
            blocks = read_for(sensor, 0.5)
            rate_hz = sum(map(len, blocks)) / (time.monotonic() - begin)
            if rate_hz == pytest.approx(7000, rel=0.1):
                break
        assert sensor.statistics().lost == 0
    assert rate_hz == pytest.approx(7000, rel=0.1)
    wrench = gathered(blocks, "wrench")
    np.testing.assert_allclose(wrench.std(axis=0), NOISE, rtol=0.15)
    np.testing.assert_allclose(wrench.mean(axis=0), LOAD, atol=0.002)


def test_the_amplifier_settings_of_the_calibration_are_loaded_before_streaming():
    with DigitalFTEmulator(lambda _: np.zeros(6)) as emulator:
        with wired_to(emulator) as port:
            port.write(START)
            bare = port.read(5 + 13)[5:]
        assert abs(struct.unpack(">6h", bare[:12])[0]) > 1000  # the amplifiers' offsets at power-up
        with closing(DigitalFT(settings_of(emulator))) as sensor:
            sensor.connect()
            sensor.start()
            assert np.abs(sensor.read(1.0).wrench).max() < 0.2


def test_a_stream_left_by_a_crashed_client_is_ended_first():
    with DigitalFTEmulator(lambda _: LOAD) as emulator:
        with wired_to(emulator) as port:
            port.write(START)
            port.read(5)
        time.sleep(0.3)
        with closing(DigitalFT(settings_of(emulator))) as sensor:
            sensor.connect()
            sensor.start()
            block = sensor.read(1.0)
            assert sensor.statistics().malformed == 0
    assert block.counter[0] == 0
    np.testing.assert_allclose(block.wrench.mean(axis=0), LOAD, atol=0.05)


@pytest.mark.parametrize(
    "faults",
    [
        LineFaults(loss=1e-3),
        LineFaults(insertion=1e-3),
        LineFaults(rubbish=0.2, rubbish_bytes=RUBBISH_BYTES),
        LineFaults(loss=3e-4, insertion=3e-4, rubbish=0.1, rubbish_bytes=RUBBISH_BYTES),
    ],
    ids=["loss", "insertion", "rubbish", "mixed"],
)
def test_damaged_bytes_alter_no_value(faults):
    with streaming() as (emulator, sensor):
        sensor.read(1.0)
        emulator.inject(faults)
        blocks = read_until(
            sensor, lambda: sensor.statistics().malformed > 20 and sensor.statistics().received > 2000
        )
        statistics = sensor.statistics()
        assert emulator.counts.lost + emulator.counts.inserted > 20
    wrench = gathered(blocks, "wrench")
    assert (np.abs(wrench - LOAD) < 7 * NOISE).all()
    assert (np.diff(gathered(blocks, "counter")) > 0).all()
    assert statistics.received + statistics.lost == gathered(blocks, "counter")[-1] + 1


def test_the_counter_stays_that_of_the_device_when_bytes_are_lost():
    with streaming(lambda time_s: np.array([10 * time_s, 0, 0, 0, 0, 0])) as (emulator, sensor):
        blocks = read_for(sensor, 0.1)
        emulator.inject(LineFaults(loss=2e-4))
        blocks += read_until(sensor, lambda: sensor.statistics().lost > 50)
        emulator.inject(LineFaults())
        blocks += read_for(sensor, 0.1)
    time_s, force = gathered(blocks, "device_time_s"), gathered(blocks, "wrench")[:, 0]
    offset = force / 10 - time_s
    assert np.median(offset[-200:]) - np.median(offset[:200]) == pytest.approx(0, abs=0.001)


def test_a_cable_that_comes_back_costs_the_samples_meanwhile():
    with streaming() as (emulator, sensor):
        blocks = read_for(sensor, 0.1)
        emulator.inject(LineFaults(unplug_at_s=0.0, unplug_for_s=0.3))
        blocks += read_until(sensor, lambda: sensor.statistics().lost > 1000)
        received = sensor.statistics().received
        blocks += read_until(sensor, lambda: sensor.statistics().received > received + 2500)
        unplugged = emulator.counts.unplugged / 13
        statistics = sensor.statistics()
    assert statistics.lost == pytest.approx(unplugged, abs=0.02 * 7000)
    assert statistics.restarts == 0
    steps = np.diff(gathered(blocks, "counter"))
    assert (steps > 1000).sum() == 1
    clock = gathered(blocks, "device_time_s")
    arrival = gathered(blocks, "host_time_ns") * 1e-9
    assert np.ptp(arrival[-500:] - clock[-500:]) < 0.1
    assert np.median(arrival[-500:] - clock[-500:]) - np.median(arrival[:500] - clock[:500]) == pytest.approx(
        0, abs=0.02
    )


def test_a_transducer_that_lost_power_is_set_up_and_started_again():
    with streaming(silence_s=0.2) as (emulator, sensor):
        sensor.read(1.0)
        emulator.inject(LineFaults(restart_at_s=0.0, restart_for_s=0.3))
        read_until(sensor, lambda: sensor.statistics().restarts == 1)
        received = sensor.statistics().received
        blocks = read_until(sensor, lambda: sensor.statistics().received > received + 3000)
    # wrong without the amplifier settings, which the power cut took
    np.testing.assert_allclose(gathered(blocks, "wrench").mean(axis=0), LOAD, atol=0.05)
    assert (np.diff(gathered(blocks, "counter")) >= 1).all()
    assert sensor.statistics().lost > 0.3 * 7000


def test_a_stream_that_cannot_be_understood_is_begun_anew():
    # zeros hold at every alignment: once that is lost they can never show which is right
    quiet = DigitalFTEmulatorSettings(noise_counts=0.0)
    with streaming(lambda _: np.zeros(6), quiet, silence_s=0.2) as (emulator, sensor):
        sensor.read(1.0)
        emulator.inject(LineFaults(insertion=0.5))
        for _ in range(8):
            sensor.read(0.05)
        emulator.inject(LineFaults())
        read_until(sensor, lambda: sensor.statistics().restarts >= 1)
        block = sensor.read(1.0)
    assert np.abs(block.wrench).max() < 1e-6


def test_an_error_of_the_device_forbids_its_samples_and_can_be_asked_for():
    with streaming(transducer=DigitalFTEmulatorSettings(status=0x0010)) as (_, sensor):
        block = sensor.read(1.0)
        with pytest.raises(DeviceError, match="stop"):
            sensor.status()
        sensor.stop()
        assert sensor.status() == ("bit 4: supply voltage too high",)
    assert (block.status == 1).all()
    assert not block.usable.any()


def test_a_restart_by_the_watchdog_is_told_but_forbids_nothing():
    with streaming(transducer=DigitalFTEmulatorSettings(status=0x0001)) as (_, sensor):
        assert "watchdog" in sensor.identity.details["status"]
        assert sensor.read(1.0).usable.all()


@pytest.mark.parametrize(
    "load",
    [(0, 0, 900.0, 0, 0, 0), (140.0, 0, 0, 0, 0, 0), (130.0, 0, 400.0, 0, 10.0, 0)],
    ids=["saturated", "beyond its rating", "saturated although in range"],
)
def test_an_overload_forbids_the_samples(load):
    with streaming(lambda _: np.array(load)) as (_, sensor):
        block = sensor.read(1.0)
    assert not block.usable.any()
    assert not block.status.any()


def test_another_calibration_can_be_chosen():
    second = DigitalFTEmulatorSettings(calibrations={1: FT33206, 3: FT33206})
    with connected(transducer=second, calibration_index=3) as (_, sensor):
        assert sensor.identity.details["calibration"] == "3"


def test_an_adapter_that_is_pulled_out_is_an_error_and_closing_is_harmless():
    with streaming() as (emulator, sensor):
        sensor.read(1.0)
        emulator.close()
        with pytest.raises(DeviceUnreachableError, match="connect again"):
            read_for(sensor, 1.0)


def test_a_device_that_is_not_there_is_said_so():
    with DigitalFTEmulator(lambda _: LOAD) as emulator:
        sensor = DigitalFT(DigitalFTSettings(port=emulator.port, slave_address=11, answer_timeout_s=0.02))
        with pytest.raises(DeviceUnreachableError, match="check power, cable"):
            sensor.connect()
        with serial.Serial(emulator.port, exclusive=True):  # the port was released
            pass


class Babbler:
    """A device that sends without end and listens to nothing."""

    def power_up(self):
        pass

    def hear(self, data, time_s):
        return b""

    def stream(self, time_s):
        return b"babble"


def test_a_device_that_does_not_stop_is_said_so():
    with SerialDeviceEmulator(Babbler(), seed=0, burst_s=0.004) as emulator:
        sensor = DigitalFT(settings_of(emulator))
        with pytest.raises(DeviceProtocolError, match="does not stop sending"):
            sensor.connect()


def test_a_device_that_sends_nothing_after_its_answer_is_said_so():
    slow = DigitalFTEmulatorSettings(sample_rate_hz=0.1)
    with (
        connected(transducer=slow, start_timeout_s=0.1) as (_, sensor),
        pytest.raises(DeviceTimeoutError, match="sent no record"),
    ):
        sensor.start()


def test_a_socket_serves_where_there_is_no_pseudo_terminal():
    with streaming(transducer=DigitalFTEmulatorSettings(line=TcpPort())) as (emulator, sensor):
        assert emulator.port.startswith("socket://127.0.0.1:")
        blocks = read_for(sensor, 0.2)
        assert sensor.statistics().lost == sensor.statistics().malformed == 0
    assert sum(map(len, blocks)) > 700
    np.testing.assert_allclose(gathered(blocks, "wrench").mean(axis=0), LOAD, atol=0.01)
