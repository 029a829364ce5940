"""The stand-alone F/T Controller: its records, its emulator, and the driver in the face of faults."""

import os
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager

import numpy as np
import pytest
import serial
from hypothesis import given, settings
from hypothesis import strategies as st
from sensor_blocks import ANSWER_TIMEOUT_S, gathered, read_for, read_until

from robot_drivers.ati.controller_ft import ControllerFT, ControllerFTSettings
from robot_drivers.ati.controller_ft.records import AsciiDecoder, BinaryDecoder, ascii_counts
from robot_drivers.ati.emulator.serial.controller_ft import ControllerFTEmulator, ControllerFTEmulatorSettings
from robot_drivers.errors import DeviceError, DeviceProtocolError, DeviceUnreachableError
from robot_drivers.serial_line.emulator.line import LineFaults

LOAD = np.array([10.0, -20.0, 30.0, 0.3, -0.6, 0.9])
SCALE = {"counts_per_newton": 10.0, "counts_per_newton_metre": 500 / 3}
FAST = {"bit_rate": 115200, **SCALE}
NO_LIMIT = np.full(6, 2.0**31)

# captured from a real controller
ASCII_RECORD = b"0,  -102,   -99,  -225,   -20,    39,   -39\r\n"
ASCII_COUNTS = (-102, -99, -225, -20, 39, -39)
BINARY_RECORD = bytes.fromhex("00 FF93 FF98 FE69 FFBB 0006 FFDB")
BINARY_COUNTS = (-109, -104, -407, -69, 6, -37)
AFTER_STREAM = bytes.fromhex("06 0D 0A 3E")


@contextmanager
def connected(source=lambda _: LOAD, box=None, **wanted):
    """An emulated controller with a sensor connected to it, not yet streaming."""
    wanted = {
        "record_bits": 16,
        "record_rate_hz": 256.0,
        "answer_timeout_s": ANSWER_TIMEOUT_S,
        **FAST,
        **wanted,
    }
    with (
        ControllerFTEmulator(source, box or ControllerFTEmulatorSettings(**FAST)) as emulator,
        closing(ControllerFT(ControllerFTSettings(port=emulator.port, **wanted))) as sensor,
    ):
        sensor.connect()
        yield emulator, sensor


@contextmanager
def streaming(*arguments, **wanted):
    with connected(*arguments, **wanted) as (emulator, sensor):
        sensor.start()
        yield emulator, sensor


@contextmanager
def wired_to(emulator):
    """A bare serial port to the emulator."""
    with serial.Serial(emulator.port, 19200, timeout=2.0) as port:
        yield port


def decoded(decoder, data, chunk=50):
    found = [decoder.feed(data[i : i + chunk]) for i in range(0, len(data), chunk)]
    return [
        np.concatenate([getattr(r, name) for r in found]) for name in ("values", "status", "index", "end")
    ]


def ascii_stream(counts):
    return b"".join(b"0,%6d,%6d,%6d,%6d,%6d,%6d\r\n" % tuple(row) for row in counts.tolist())


def binary_stream(counts, width):
    return b"".join(
        b"\0" + b"".join(value.to_bytes(width, "big", signed=True) for value in row)
        for row in counts.tolist()
    )


def test_the_captured_ascii_record():
    assert len(ASCII_RECORD) == AsciiDecoder(16).record_size == 45
    assert ascii_counts(ASCII_RECORD[:-2], 16) == (0, *ASCII_COUNTS)
    assert ascii_counts(ASCII_RECORD[:-2], 24) is None


def test_an_ascii_record_of_24_bits_has_57_bytes():
    line = b"3,-8388608,       1,      -1, 8388607,   20480,  -20480"
    assert len(line) + 2 == AsciiDecoder(24).record_size == 57
    assert ascii_counts(line, 24) == (3, -8388608, 1, -1, 8388607, 20480, -20480)


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"QS",
        b"0,  -102,   -99,  -225,   -20,    39",
        b"0,  -102,   -99,  -225,   -20,    39,  -39",
        b"0,  -102,   -99,  -225,   -20,    39,  - 39",
        b"0,  -102,   -99,  -225,   -20,    39, 99999",
        b"0,  -102,   -99,  -225,   -20,    39,   -3\xb2",
        b"x,  -102,   -99,  -225,   -20,    39,   -39",
    ],
)
def test_what_is_no_ascii_record_is_none(line):
    assert ascii_counts(line, 16) is None


@pytest.mark.parametrize("line_end", [b"\r\n", b"\r"])
def test_ascii_records_are_found_between_what_else_the_controller_says(line_end):
    record = ASCII_RECORD.replace(b"\r\n", line_end)
    values, status, index, end = decoded(AsciiDecoder(16), line_end + 3 * record + AFTER_STREAM, chunk=7)
    np.testing.assert_array_equal(values, [ASCII_COUNTS] * 3)
    np.testing.assert_array_equal(status, 0)
    np.testing.assert_array_equal(index, [0, 1, 2])
    assert (np.diff(end) == len(record)).all()


def test_the_captured_binary_records():
    decoder = BinaryDecoder(16, NO_LIMIT)
    values, status, index, end = decoded(decoder, 6 * BINARY_RECORD + AFTER_STREAM, chunk=7)
    np.testing.assert_array_equal(values, [BINARY_COUNTS] * 2)
    np.testing.assert_array_equal(status, 0)
    np.testing.assert_array_equal(index, [0, 1])
    np.testing.assert_array_equal(end, [13, 26])


def test_binary_counts_of_24_bits_keep_their_sign():
    counts = np.array([[-8388608, 8388607, -1, 1, 65536, -65536]] * 6)
    values, *_ = decoded(BinaryDecoder(24, NO_LIMIT), binary_stream(counts, 3))
    np.testing.assert_array_equal(values, counts[:2])


@pytest.mark.parametrize("line_end", [b"", b"\r\n"])
def test_an_end_of_line_after_the_echo_is_no_part_of_the_first_record(line_end):
    values, _, _, end = decoded(BinaryDecoder(16, NO_LIMIT), line_end + 5 * BINARY_RECORD, chunk=1)
    np.testing.assert_array_equal(values, [BINARY_COUNTS])
    np.testing.assert_array_equal(end, [len(line_end) + 13])


EDITS = st.lists(
    st.tuples(st.integers(60, 300), st.sampled_from(["lose", "insert"]), st.integers(1, 30)), max_size=6
)


@settings(max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), edits=EDITS, chunk=st.integers(1, 200))
def test_lost_and_added_bytes_alter_no_ascii_value(seed, edits, chunk):
    random = np.random.default_rng(seed)
    counts = random.integers(-32768, 32768, (60, 6))
    data, position = bytearray(ascii_stream(counts)), 0
    for distance, what, size in edits:
        position += distance
        if what == "lose":
            del data[position : position + size]
        else:
            data[position:position] = random.bytes(size)
    decoder = AsciiDecoder(16)
    values, _, index, _ = decoded(decoder, bytes(data), chunk)
    rows = iter(map(tuple, counts.tolist()))
    assert all(any(value == row for row in rows) for value in map(tuple, values.tolist()))
    assert (np.diff(index) > 0).all()
    assert decoder.damages <= len(edits)
    np.testing.assert_array_equal(values[-1], counts[-1])


@settings(max_examples=50)
@given(data=st.binary(min_size=1, max_size=2000), chunk=st.integers(1, 200), bits=st.sampled_from([16, 24]))
def test_rubbish_raises_nothing(data, chunk, bits):
    decoded(AsciiDecoder(bits), data, chunk)
    decoded(BinaryDecoder(bits, NO_LIMIT), data, chunk)


def test_a_lost_ascii_record_is_counted():
    data = 3 * ASCII_RECORD + ASCII_RECORD[:20] + ASCII_RECORD[31:] + 2 * ASCII_RECORD
    decoder = AsciiDecoder(16)
    _, _, index, _ = decoded(decoder, data)
    np.testing.assert_array_equal(index, [0, 1, 2, 4, 5])
    assert decoder.damages == 1


def test_a_lost_byte_of_a_loaded_binary_stream_is_noticed():
    random = np.random.default_rng(2)
    load = np.array([400, -300, 800, 70, -90, 110])
    counts = load + random.integers(-2, 3, (60, 6))
    limit = 2.5 * np.array([1300, 1300, 4000, 1667, 1667, 1667])
    for lost in range(20 * 13, 21 * 13):
        data = bytearray(binary_stream(counts, 2))
        del data[lost]
        decoder = BinaryDecoder(16, limit)
        values, _, index, _ = decoded(decoder, bytes(data))
        np.testing.assert_array_equal(values, counts[index])
        assert decoder.damages == 1
        assert len(values) > 40


def test_the_emulator_echoes_and_prompts_as_captured():
    with ControllerFTEmulator(lambda _: LOAD) as emulator, wired_to(emulator) as port:
        for command, size in [(b"", 5), (b"SZ", 9), (b"CD A", 11), (b"SA 16", 12)]:
            port.write(command + b"\r")
            reply = port.read(size)
            assert reply.startswith(command)
            assert reply.endswith(b">")
            if not command:
                assert reply == bytes.fromhex("0D 0A 0D 0A 3E")


def test_the_emulator_streams_captured_records_until_a_character_comes():
    wrench = np.array(ASCII_COUNTS) / np.repeat([10, 500 / 3], 3)
    quiet = ControllerFTEmulatorSettings(bit_rate=115200, noise_std=(0.0,) * 6)
    with ControllerFTEmulator(lambda _: wrench, quiet) as emulator, wired_to(emulator) as port:
        port.write(b"QS\r")
        assert port.read(2 + 3 * 45) == b"QS" + 3 * ASCII_RECORD
        port.write(b"\r")
        rest = port.read(100_000)
        assert rest.endswith(AFTER_STREAM + bytes.fromhex("0D 0A 0D 0A 3E"))
        port.write(b"CD B\r")
        port.read(11)
        port.write(b"QR\r")
        assert (
            port.read(2 + 13 + 4) == b"QR\0" + bytes.fromhex("FF9A FF9D FF1F FFEC 0027 FFD9") + AFTER_STREAM
        )


def test_the_line_limits_the_record_rate():
    box = ControllerFTEmulatorSettings(bit_rate=38400)
    with ControllerFTEmulator(lambda _: LOAD, box) as emulator, wired_to(emulator) as port:
        port.timeout = 30.0
        begin = time.monotonic()
        port.write(b"QS\r")
        assert len(port.read(2 + 40 * 45)) == 2 + 40 * 45
        assert time.monotonic() - begin > 40 * 450 / 38400


@pytest.mark.parametrize("echo_end", [b"", b"\r\n"])
@pytest.mark.parametrize("bits", [16, 24])
@pytest.mark.parametrize("record_format", ["ascii", "binary"])
def test_the_size_of_a_count_is_found_from_one_record(record_format, bits, echo_end):
    box = ControllerFTEmulatorSettings(record_bits=bits, before_records=echo_end, **FAST)
    with streaming(box=box, record_format=record_format, record_bits=None) as (_, sensor):
        assert sensor.identity.details["records"] == f"{record_format}, {bits} bit"
        blocks = [sensor.read(1.0) for _ in range(5)]
        assert sensor.statistics().malformed == 0
    np.testing.assert_allclose(gathered(blocks, "wrench").mean(axis=0), LOAD, atol=0.006)
    assert gathered(blocks, "usable").all()


@pytest.mark.parametrize(("limit_hz", "expected_hz"), [(None, 115200 / 450), (100.0, 100.0)])
def test_the_record_rate_is_measured(limit_hz, expected_hz):
    box = ControllerFTEmulatorSettings(record_rate_hz=limit_hz, **FAST)
    for _ in range(10):  # a busy machine now and then holds the emulated box up
        with connected(box=box, record_rate_hz=None) as (_, sensor):
            told = sensor.identity.details["record rate"]
        assert "measured" in told
        if float(told.split()[0]) == pytest.approx(expected_hz, rel=0.1):
            break
    assert float(told.split()[0]) == pytest.approx(expected_hz, rel=0.1)


def test_a_stream_left_by_a_crashed_client_is_ended_first():
    with ControllerFTEmulator(lambda _: LOAD, ControllerFTEmulatorSettings(**FAST)) as emulator:
        with wired_to(emulator) as port:
            port.write(b"CD B\rQS\r")
            port.read(100)
        wanted = ControllerFTSettings(
            port=emulator.port,
            record_bits=16,
            record_rate_hz=256.0,
            answer_timeout_s=ANSWER_TIMEOUT_S,
            **FAST,
        )
        with closing(ControllerFT(wanted)) as sensor:
            sensor.connect()
            sensor.start()
            np.testing.assert_allclose(sensor.read(1.0).wrench[0], LOAD, atol=0.1)


def test_a_bias_is_set_only_on_request_and_only_between_streams():
    with streaming() as (_, sensor):
        np.testing.assert_allclose(sensor.read(1.0).wrench[0], LOAD, atol=0.1)
        with pytest.raises(DeviceError, match="stop"):
            sensor.set_bias()
        sensor.stop()
        sensor.set_bias()
        sensor.start()
        np.testing.assert_allclose(sensor.read(1.0).wrench[0], 0, atol=0.1)


def test_averaging_is_asked_for():
    noisy = ControllerFTEmulatorSettings(
        bit_rate=115200,
        counts_per_newton=1000,
        counts_per_newton_metre=1e4,
        noise_std=(0.1,) * 3 + (0.01,) * 3,
    )
    scale = {"counts_per_newton": 1000, "counts_per_newton_metre": 1e4}
    with streaming(lambda _: np.zeros(6), noisy, averaging=16, **scale) as (_, sensor):
        blocks = read_for(sensor, 0.5)
    np.testing.assert_allclose(gathered(blocks, "wrench").std(axis=0), [0.025] * 3 + [0.0025] * 3, rtol=0.3)


def test_damaged_bytes_alter_no_ascii_value():
    with streaming() as (emulator, sensor):
        emulator.inject(LineFaults(loss=2e-3, rubbish=0.05))
        blocks, end = [], time.monotonic() + 60.0
        while sensor.statistics().malformed <= 5 or sensor.statistics().received <= 60:
            assert time.monotonic() < end, "too little came"
            blocks.append(sensor.read(0.05))
        statistics = sensor.statistics()
    np.testing.assert_allclose(
        gathered(blocks, "wrench"), np.broadcast_to(LOAD, (statistics.received, 6)), atol=0.1
    )


def test_a_cable_that_comes_back_costs_the_records_meanwhile():
    with streaming() as (emulator, sensor):
        blocks = read_for(sensor, 0.1)
        emulator.inject(LineFaults(unplug_at_s=0.0, unplug_for_s=0.3))
        blocks += read_until(sensor, lambda: sensor.statistics().lost > 0)
        statistics = sensor.statistics()
    assert statistics.lost == pytest.approx(emulator.counts.unplugged / 45, abs=0.02 * 256 + 1)
    assert (np.diff(gathered(blocks, "counter")) > 50).sum() == 1


def test_the_late_end_of_a_stream_is_no_answer_to_the_next_command():
    far, near = os.openpty()
    heard = []

    def answer():
        """Echo and prompt for each command; before the first echo, what was left of a stream."""
        while (letters := os.read(far, 1)) and letters != b"\0":
            while not letters.endswith(b"\r"):
                letters += os.read(far, 1)
            heard.append(letters[:-1])
            left = ASCII_RECORD + AFTER_STREAM if letters == b"CL 1\r" else b""
            os.write(far, left + letters[:-1] + b"\r\n>")

    with ThreadPoolExecutor(1) as controller:
        done = controller.submit(answer)
        settings = ControllerFTSettings(
            port=os.ttyname(near),
            record_bits=16,
            record_rate_hz=256.0,
            answer_timeout_s=ANSWER_TIMEOUT_S,
            **FAST,
        )
        try:
            with closing(ControllerFT(settings)) as sensor:
                sensor.connect()
        finally:
            os.write(near, b"\0")
        done.result(60.0)
    os.close(near)
    os.close(far)
    assert heard[1:3] == [b"CL 1", b"CD R"]


def test_a_controller_that_lost_power_is_set_up_and_started_again():
    with streaming(silence_s=0.2, record_format="binary") as (emulator, sensor):
        sensor.read(1.0)
        emulator.inject(LineFaults(restart_at_s=0.0, restart_for_s=0.3))
        end = time.monotonic() + 60.0
        while sensor.statistics().restarts == 0 and time.monotonic() < end:
            sensor.read(0.05)
        np.testing.assert_allclose(sensor.read(1.0).wrench[0], LOAD, atol=0.1)
        assert sensor.statistics().restarts == 1


def test_an_error_digit_forbids_the_record():
    with streaming(lambda _: np.array([0, 0, 900.0, 0, 0, 0])) as (_, sensor):
        block = sensor.read(1.0)
    assert (block.status == 1).all()
    assert not block.usable.any()


def test_a_count_at_its_end_forbids_the_record():
    scale = {"counts_per_newton": 400.0, "counts_per_newton_metre": 400.0}
    box = ControllerFTEmulatorSettings(bit_rate=115200, **scale)
    with streaming(lambda _: np.array([100.0, 0, 0, 0, 0, 0]), box, **scale) as (_, sensor):
        block = sensor.read(1.0)
    assert not block.status.any()
    assert not block.usable.any()


def test_no_answer_at_all_is_said_so():
    with ControllerFTEmulator(lambda _: LOAD) as emulator:
        emulator.inject(LineFaults(unplug_at_s=0.0, unplug_for_s=60.0))
        sensor = ControllerFT(ControllerFTSettings(port=emulator.port, **SCALE))
        with pytest.raises(DeviceUnreachableError, match="9600 bit/s"):
            sensor.connect()


def test_an_answer_that_does_not_end_in_the_prompt_is_said_so():
    with ControllerFTEmulator(lambda _: LOAD) as emulator:
        emulator.inject(LineFaults(corruption=1.0))
        sensor = ControllerFT(ControllerFTSettings(port=emulator.port, **SCALE))
        with pytest.raises(DeviceProtocolError, match="prompt"):
            sensor.connect()


def test_the_scale_must_be_told():
    with pytest.raises(TypeError, match="counts_per_newton"):
        ControllerFTSettings(port="none")
