import socket
import threading
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.ati.emulator import BoxConfiguration, EmulatorSettings, NetFTEmulator
from robot_drivers.ati.netft import command_interface as ci
from robot_drivers.errors import (
    ConfigurationError,
    DeviceFaultError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)

GOLDEN_CALIBRATION = bytes.fromhex("1234 02 03 000F4240 000F4240" + "0FA0" * 6)


def test_requests_have_20_bytes_as_in_the_manual():
    assert bytes.fromhex("00" * 20) == ci.READFT_REQUEST
    assert bytes.fromhex("01" + "00" * 19) == ci.READCALINFO_REQUEST


def test_the_calibration_of_the_manual_is_decoded():
    calibration = ci.parse_calibration(GOLDEN_CALIBRATION)
    assert calibration.scaling.si_per_count.tolist() == [1e-6] * 6
    assert calibration.scale_factors == (4000,) * 6


def test_other_units_are_carried_to_si():
    answer = bytes.fromhex("1234 01 02 000003E8 000007D0" + "0001" * 6)  # 1000 per lbf, 2000 per lbf-ft
    factors = ci.parse_calibration(answer).scaling.si_per_count
    np.testing.assert_allclose(factors, [4.4482216152605e-3] * 3 + [1.3558179483314004 / 2000] * 3)


def test_a_reading_is_signed_and_its_status_is_the_upper_half_of_the_word():
    reading = ci.parse_reading(bytes.fromhex("1234 8002 7D00 8300 0001 FFFF 0000 8000"))
    assert reading.status == 0x80020000
    assert reading.counts16 == (32000, -32000, 1, -1, 0, -32768)
    wrench = reading.wrench(ci.parse_calibration(GOLDEN_CALIBRATION))
    np.testing.assert_allclose(wrench, [128, -128, 0.004, -0.004, 0, -131.072])


def test_a_transform_is_sent_in_packed_hundredths():
    request = ci.transform_request(
        (10, -0.5, 327.67), (90, 0, -1), ci.DistanceUnit.MILLIMETRE, ci.AngleUnit.DEGREE
    )
    assert request == bytes.fromhex("02 03 01 03E8 FFCE 7FFF 2328 0000 FF9C 0000000000")


@pytest.mark.parametrize("value", [327.68, -400, 0.005, float("nan"), float("inf")])
def test_a_transform_that_the_box_cannot_hold_is_refused(value):
    with pytest.raises(ConfigurationError, match="tool transform"):
        ci.transform_request((0, 0, value), (0, 0, 0), ci.DistanceUnit.METRE, ci.AngleUnit.RADIAN)


def test_a_refused_transform_is_a_fault_of_the_device():
    ci.parse_write_answer(bytes.fromhex("1234 02 00"))
    with pytest.raises(DeviceFaultError, match="status 5"):
        ci.parse_write_answer(bytes.fromhex("1234 02 05"))


@given(st.binary(max_size=30))
def test_no_answer_of_wrong_length_or_header_passes(answer):
    for parse, size in ((ci.parse_reading, 16), (ci.parse_calibration, 24), (ci.parse_write_answer, 4)):
        if len(answer) != size or answer[:2] != b"\x12\x34":
            with pytest.raises(DeviceProtocolError):
                parse(answer)


@given(st.binary(min_size=22, max_size=22))
def test_a_calibration_is_either_refused_or_gives_positive_factors(body):
    try:
        calibration = ci.parse_calibration(b"\x12\x34" + body)
    except DeviceProtocolError:
        return
    factors = calibration.scaling.si_per_count
    assert np.isfinite(factors).all()
    assert (factors > 0).all()


@contextmanager
def box_that_answers(*pieces):
    """A server that takes one request and sends its answer in pieces, each in a packet of its own."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve():
            client, _ = server.accept()
            with client:
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                client.recv(20, socket.MSG_WAITALL)
                for piece in pieces:
                    client.sendall(piece)
                    threading.Event().wait(0.02)
                if pieces and pieces[-1] == b"":
                    client.recv(1)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield server.getsockname()[1]
        finally:
            thread.join()


def test_an_answer_that_comes_in_pieces_is_read_whole():
    pieces = GOLDEN_CALIBRATION[:3], GOLDEN_CALIBRATION[3:20], GOLDEN_CALIBRATION[20:]
    with box_that_answers(*pieces) as port, ci.CommandInterface("127.0.0.1", port) as box:
        assert box.read_calibration() == ci.parse_calibration(GOLDEN_CALIBRATION)


def test_a_connection_that_closes_within_an_answer_is_told():
    with (
        box_that_answers(GOLDEN_CALIBRATION[:10]) as port,
        ci.CommandInterface("127.0.0.1", port) as box,
        pytest.raises(DeviceProtocolError, match="10 of 24 bytes"),
    ):
        box.read_calibration()


def test_an_answer_that_stops_runs_into_the_timeout():
    with (
        box_that_answers(GOLDEN_CALIBRATION[:10], b"") as port,
        ci.CommandInterface("127.0.0.1", port, timeout_s=0.2) as box,
        pytest.raises(DeviceTimeoutError, match="10 of 24 bytes"),
    ):
        box.read_calibration()


def test_a_closed_port_is_unreachable():
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
    with pytest.raises(DeviceUnreachableError, match=str(port)), ci.CommandInterface("127.0.0.1", port):
        raise AssertionError("connected to a closed port")


def test_the_emulated_box_answers_with_the_bytes_of_the_manual():
    settings = EmulatorSettings(scale_factors=(4000,) * 6, noise_std=(0.0,) * 6)
    wrench = np.array([8.0, -8.0, 0.004, 0.0, 0.0, 0.004])
    with (
        NetFTEmulator(lambda _: wrench, settings) as emulator,
        socket.create_connection(("127.0.0.1", emulator.command_port), timeout=2) as client,
    ):
        client.sendall(bytes.fromhex("01" + "00" * 19))
        assert client.recv(24, socket.MSG_WAITALL) == GOLDEN_CALIBRATION
        client.sendall(bytes(20))
        assert client.recv(16, socket.MSG_WAITALL) == bytes.fromhex("1234 0000 07D0 F830 0001 0000 0000 0001")
        client.sendall(bytes.fromhex("02 03 01") + bytes(17))
        assert client.recv(4, socket.MSG_WAITALL) == bytes.fromhex("1234 02 00")


def test_a_reading_of_the_emulated_box_is_its_load_in_si():
    load = np.array([1.0, -20.0, 300.0, 0.1, -1.0, 5.0])
    millimetres = BoxConfiguration(
        torque_unit="N-mm", newton_metres=1e-3, torque_code=4, counts_per_torque=1000
    )
    with (
        NetFTEmulator(lambda _: load, EmulatorSettings(configurations=(millimetres,))) as emulator,
        ci.CommandInterface("127.0.0.1", emulator.command_port) as box,
    ):
        wrench = box.read_ft().wrench(box.read_calibration())
        box.write_transform((0, 0, 40), (0, 0, 0))
    np.testing.assert_allclose(wrench, load, atol=0.1)
