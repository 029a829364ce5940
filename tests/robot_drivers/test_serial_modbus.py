"""Modbus RTU against literal bytes, and against a device that answers wrongly."""

import os
import threading
from contextlib import contextmanager, suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.ati.digital_ft import modbus
from robot_drivers.errors import (
    ConfigurationError,
    DeviceFaultError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)
from robot_drivers.serial_line.line import SerialLine

termios = pytest.importorskip("termios", reason="pseudo-terminals are a matter of POSIX")


@contextmanager
def device_that_answers(*answers):
    """A master on a line whose far end gives these answers (hex) to the requests, one each; "" is silence."""
    far, near = os.openpty()
    heard = []

    def answer():
        with suppress(OSError):  # the line is closed when the test is over
            for text in answers:
                heard.append(os.read(far, 300))
                os.write(far, bytes.fromhex(text))

    thread = threading.Thread(target=answer)
    thread.start()
    line = SerialLine(os.ttyname(near), 1_250_000, "E")
    try:
        yield modbus.ModbusMaster(line, 10, timeout_s=0.15), heard, line
    finally:
        line.close()
        os.close(near)
        thread.join()
        os.close(far)


@pytest.mark.parametrize(
    "frame",
    [
        "0A 04 00 27 00 06 C1 78",  # a driver's literal: six input registers from 0x27
        "0A 46 55 A3 9D",
        "0A 46 01 A2 62",
        "0A 6A AA FF 1D",
        "0A 6A 18 7F 68",
        "0A 6A 01 BE A2",
    ],
)
def test_the_crc_of_known_frames(frame):
    *body, low, high = bytes.fromhex(frame)
    assert modbus.crc16(bytes(body)) == high << 8 | low
    assert modbus.framed(bytes(body)).hex(" ").upper() == frame


def test_the_check_value_of_the_crc():
    assert modbus.crc16(b"123456789") == 0x4B37


@given(data=st.binary(max_size=60), position=st.integers(0, 500), change=st.integers(1, 255))
def test_the_crc_sees_any_change_of_one_byte(data, position, change):
    frame = bytearray(modbus.framed(data))
    frame[position % len(frame)] ^= change
    assert modbus.framed(bytes(frame[:-2])) != frame


def test_a_late_answer_to_another_question_is_not_taken_for_this_one():
    late, echo = (
        modbus.framed(bytes.fromhex("0a 10 0004 0002")),
        modbus.framed(bytes.fromhex("0a 10 0006 0002")),
    )
    with device_that_answers(late.hex(), echo.hex()) as (master, heard, _):
        master.write_holding(6, [0x886F, 1])
    assert len(heard) == 2


def test_an_answer_that_never_fits_is_told_with_what_it_was():
    other = modbus.framed(bytes.fromhex("0a 10 0004 0002")).hex()
    with (
        device_that_answers(other, other, other) as (master, _, _),
        pytest.raises(DeviceProtocolError, match="answers another question"),
    ):
        master.write_holding(6, [0x886F, 1])


def test_requests_are_the_bytes_of_the_protocol():
    assert modbus.read_request(10, 0x04, 0x27, 6).hex() == "0a0400270006c178"
    assert modbus.vendor_request(10, 0x46, 0x55).hex() == "0a4655a39d"
    assert modbus.write_request(10, 6, [0x886F, 1])[:-2].hex() == "0a100006000204886f0001"


def test_registers_are_read_in_chunks_that_fit_one_answer():
    full = modbus.framed(bytes([10, 3, 250]) + bytes(range(250))).hex()
    rest = modbus.framed(bytes([10, 3, 86]) + bytes(86)).hex()
    with device_that_answers(full, rest) as (master, heard, _):
        assert master.read_holding(0x00E3, 168) == bytes(range(250)) + bytes(86)
    assert [request[:6].hex() for request in heard] == ["0a0300e3007d", "0a030160002b"]


def test_what_follows_the_answer_to_a_vendor_function_stays_on_the_line():
    with device_that_answers("0A 46 01 A2 62" + "11 22 33") as (master, _, line):
        master.command(0x46, 0x55)
        assert line.read_exactly(3, 0.2) == b"\x11\x22\x33"


def test_a_damaged_or_missing_answer_is_asked_for_again():
    with device_that_answers("0A 46 01 A2 63", "", "0A 46 01 A2 62") as (master, heard, _):
        master.command(0x46, 0x55)
    assert heard == [bytes.fromhex("0A 46 55 A3 9D")] * 3


def test_three_damaged_answers_are_an_error():
    with (
        device_that_answers(*["0A 46 01 A2 63"] * 3) as (master, *_),
        pytest.raises(DeviceProtocolError, match="damaged"),
    ):
        master.command(0x46, 0x55)


def test_the_answer_of_another_device_is_none():
    other = modbus.framed(bytes([11, 0x46, 1])).hex()
    with (
        device_that_answers(*[other] * 3) as (master, *_),
        pytest.raises(DeviceProtocolError, match="answered with"),
    ):
        master.command(0x46, 0x55)


def test_silence_is_a_timeout():
    with (
        device_that_answers("", "", "") as (master, *_),
        pytest.raises(DeviceTimeoutError, match="0 of 3 bytes"),
    ):
        master.command(0x46, 0x55)


def test_a_refusal_is_told_in_words_and_not_repeated():
    refusal = modbus.framed(bytes([10, 0x83, 2])).hex()
    with device_that_answers(refusal) as (master, heard, _):
        with pytest.raises(DeviceFaultError, match="illegal address"):
            master.read_holding(0x9999, 1)
        assert len(heard) == 1


def test_a_vendor_function_that_fails_is_a_fault():
    failed = modbus.framed(bytes([10, 0x6A, 0])).hex()
    with device_that_answers(failed) as (master, *_), pytest.raises(DeviceFaultError, match="0x6a"):
        master.command(0x6A, 0xAA)


def test_a_port_that_is_not_there_says_what_to_check():
    with pytest.raises(DeviceUnreachableError, match="check its name"):
        SerialLine("/dev/no-such-port", 9600, "N")


def test_a_bit_rate_that_cannot_be_is_refused():
    with pytest.raises(ConfigurationError, match="-1 bit/s"):
        SerialLine("/dev/no-such-port", -1, "N")


def test_a_port_in_use_is_not_shared():
    far, near = os.openpty()
    first = SerialLine(os.ttyname(near), 9600, "N")
    try:
        with pytest.raises(DeviceUnreachableError, match="no other program"):
            SerialLine(os.ttyname(near), 9600, "N")
    finally:
        first.close()
        os.close(near)
        os.close(far)


def test_bytes_with_wrong_parity_are_left_to_the_system_to_drop():
    far, near = os.openpty()
    line = SerialLine(os.ttyname(near), 115200, "E")
    try:
        input_flags = termios.tcgetattr(near)[0]
    finally:
        line.close()
        os.close(near)
        os.close(far)
    assert input_flags & termios.INPCK
    assert input_flags & termios.IGNPAR
