"""The NETCANOEM driver and the emulated board on python-can's virtual bus."""

import itertools
import struct
from contextlib import contextmanager

import can
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sensor_blocks import first_block, read_for, read_until

from robot_drivers.ati.emulator.can.netcanoem import BoardFaults, BoardSettings, NetCANOEMEmulator
from robot_drivers.ati.netcanoem import NetCANOEM, NetCANOEMSettings, frames
from robot_drivers.ati.transducer.gamma import GAGE_MATRIX
from robot_drivers.errors import (
    DeviceFaultError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)

LOAD = np.array([10.0, -20.0, 30.0, 0.1, -0.2, 0.3])
_channels = (f"netcanoem-{number}" for number in itertools.count())


@contextmanager
def connected(source=lambda _: LOAD, board=None, **settings):
    """An emulated board with a sensor connected to it, not yet polled."""
    channel = next(_channels)
    with NetCANOEMEmulator(source, BoardSettings(channel=channel, **(board or {}))) as emulator:
        sensor = NetCANOEM(NetCANOEMSettings(channel=channel, interface="virtual", **settings))
        try:
            sensor.connect()
            yield emulator, sensor
        finally:
            sensor.close()


# ---- bytes


def test_identifiers_carry_the_shifted_base():
    assert frames.identifier(0x20, frames.Opcode.GAGES) == 0x200
    assert frames.identifier(0x7F, frames.Opcode.FIRMWARE) == 0x7FF


def test_gages_come_even_first_signed_and_big_endian():
    even, odd = bytes.fromhex("8040 0001 FFFE 7FFF"), bytes.fromhex("0002 8000 0100")
    assert frames.decode_gages(even, odd) == (0x8040, (1, 2, -2, -32768, 32767, 256))


def test_counts_units_serial_and_firmware_are_decoded():
    scaling = frames.decode_scaling(bytes.fromhex("000F4240 000003E8"), bytes([1, 4]))
    np.testing.assert_allclose(scaling.si_per_count, [4.4482216152605e-6] * 3 + [1e-6] * 3)
    assert frames.decode_serial(b"FT33206\0") == "FT33206"
    assert frames.decode_firmware(bytes.fromhex("03 08 001B")) == (3, 8, 27)


@pytest.mark.parametrize("units", [bytes([0, 3]), bytes([2, 7])])
def test_unknown_unit_codes_are_refused(units):
    with pytest.raises(DeviceProtocolError, match="unit codes"):
        frames.decode_scaling(bytes.fromhex("000F4240 000F4240"), units)


@pytest.mark.parametrize("entry", [0.0, float("nan"), float("inf")])
def test_a_matrix_that_no_transducer_has_is_refused(entry, monkeypatch):
    matrix = np.full((6, 6), entry)
    monkeypatch.setattr("robot_drivers.ati.emulator.can.netcanoem.GAGE_MATRIX", matrix)
    with pytest.raises(DeviceProtocolError, match="calibration FT33206: the matrix"), connected():
        pass


@given(st.binary(min_size=8, max_size=8), st.binary(min_size=6, max_size=6))
def test_any_gages_are_decoded_as_the_table_says(even, odd):
    status, gages = frames.decode_gages(even, odd)
    assert (status, gages[0], gages[2], gages[4]) == struct.unpack(">Hhhh", even)
    assert (gages[1], gages[3], gages[5]) == struct.unpack(">hhh", odd)


@pytest.mark.parametrize(
    ("identifier", "request_hex", "answers"),
    [
        (0x200, "", [(0x200, "0000 0001 0003 0005"), (0x201, "0002 0004 0006")]),
        (0x206, "00", [(0x206, "00")]),
        (0x205, "", [(0x205, "46 54 33 33 32 30 36 00")]),
        (0x207, "", [(0x207, "000F4240 000F4240")]),
        (0x208, "", [(0x208, "02 03")]),
        (0x20F, "", [(0x20F, "03 08 001B")]),
        (0x202, "06", []),
        (0x210, "", []),
    ],
)
def test_the_emulated_board_answers_with_the_bytes_of_the_manual(identifier, request_hex, answers):
    channel = next(_channels)
    load = 1e-6 * GAGE_MATRIX @ [1, 2, 3, 4, 5, 6]
    settings = BoardSettings(channel=channel, noise_std=0.0)
    with NetCANOEMEmulator(lambda _: load, settings), can.Bus(interface="virtual", channel=channel) as bus:
        bus.send(
            can.Message(arbitration_id=identifier, data=bytes.fromhex(request_hex), is_extended_id=False)
        )
        received = [bus.recv(0.1 if answers else 0.05) for _ in range(len(answers) or 1)]
    found = [(message.arbitration_id, bytes(message.data)) for message in received if message]
    assert found == [(answer, bytes.fromhex(data)) for answer, data in answers]


def test_the_emulated_board_sends_its_matrix_row_by_row_in_three_pieces():
    channel = next(_channels)
    with (
        NetCANOEMEmulator(lambda _: LOAD, BoardSettings(channel=channel)),
        can.Bus(interface="virtual", channel=channel) as bus,
    ):
        bus.send(can.Message(arbitration_id=0x202, data=[2], is_extended_id=False))
        pieces = [bus.recv(1.0) for _ in range(3)]
    assert [piece.arbitration_id for piece in pieces] == [0x202, 0x203, 0x204]
    row = [value for piece in pieces for value in struct.unpack(">ff", piece.data)]
    assert row == pytest.approx([7571.881, 108.7123, 7652.86, 21.27031, 7602.011, 60.34784], rel=1e-6)


# ---- driver


def test_connecting_reads_who_the_board_is():
    with connected() as (_, sensor):
        identity = sensor.identity
    assert identity.serial == "FT33206"
    assert identity.details["firmware"] == "3.8 build 27"
    assert identity.details["units"] == "N, N-m"


def test_older_firmware_that_tells_no_units_has_a_million_counts_per_newton():
    with connected(board={"firmware": (3, 6, 1)}) as (_, sensor):
        assert sensor.identity.details["counts per unit"] == "1e+06, 1e+06"


def test_another_base_is_another_board():
    with connected(board={"base": 0x31}, base=0x31) as (_, sensor):
        assert "0x31" in sensor.identity.address
    with pytest.raises(DeviceTimeoutError, match="base 0x20"), connected(board={"base": 0x31}):
        pass


def test_the_calibration_is_selected_and_its_echo_compared():
    with connected(board={"calibrations": (5,)}, calibration=5) as (_, sensor):
        sensor.start()
        assert sensor.read(1.0).usable.all()
    with (
        pytest.raises(DeviceFaultError, match="calibration is empty"),
        connected(board={"calibrations": (5,)}),
    ):
        pass
    with connected() as (emulator, sensor):
        emulator.faults = BoardFaults(deaf_to_calibration=True)
        channel = emulator.settings.channel
        deaf = NetCANOEM(NetCANOEMSettings(channel=channel, interface="virtual", calibration=3))
        with pytest.raises(DeviceProtocolError, match="calibration 0 instead of 3"):
            deaf.connect()


def test_a_board_that_was_reset_gets_its_calibration_selected_again():
    with connected(board={"calibrations": (5,)}, calibration=5) as (emulator, sensor):
        sensor.start()
        sensor.read(1.0)
        emulator.faults = BoardFaults(silence=1.0)
        while len(sensor.read(0.1)):
            pass
        emulator.reset()
        emulator.faults = BoardFaults()
        block = sensor.read(1.0)
        assert len(block)
        assert block.usable.all()


def test_a_board_that_does_not_select_its_calibration_again_is_told_by_the_next_read():
    with connected(calibration=5, board={"calibrations": (5,)}) as (emulator, sensor):
        sensor.start()
        sensor.read(1.0)
        emulator.faults = BoardFaults(silence=1.0, deaf_to_calibration=True)
        emulator.reset()
        with pytest.raises(DeviceProtocolError, match="calibration 0 instead of 5"):
            first_block(sensor, lambda _: False)


@pytest.mark.parametrize("missing", ["silence", "halving", "cutting"])
def test_a_request_without_a_whole_answer_is_one_lost_sample(missing):
    with connected(answer_timeout_s=0.5) as (emulator, sensor):
        emulator.faults = BoardFaults(**{missing: 0.1})
        emulator.counts.requests = 0
        sensor.start()
        blocks = read_until(sensor, lambda: emulator.counts.unanswered >= 2)
        sensor.stop()
        blocks.append(sensor.read(0.0))
        statistics, counts = sensor.statistics(), emulator.counts
    assert statistics.lost == counts.unanswered > 0
    assert statistics.received == counts.requests - counts.unanswered
    assert statistics.malformed == counts.cut
    numbers = np.concatenate([block.counter for block in blocks])
    assert len(set(numbers)) == len(numbers) == statistics.received
    assert 1 <= numbers.min() <= numbers.max() <= counts.requests
    assert np.abs(np.concatenate([block.wrench for block in blocks]) - LOAD).max() < 0.2


@pytest.mark.parametrize("status", [1 << bit for bit in (1, 2, 3, 4, 5, 6, 7, 11, 12)])
def test_a_critical_status_forbids_the_sample(status):
    with connected() as (emulator, sensor):
        sensor.start()
        emulator.faults = BoardFaults(status=status | 0x8000)
        assert not first_block(sensor, lambda block: block.status.all()).usable.any()


def test_a_watchdog_reset_is_a_warning():
    with connected() as (emulator, sensor):
        sensor.start()
        emulator.faults = BoardFaults(status=0x8001)
        block = first_block(sensor, lambda block: block.status.all())
        assert block.usable.all()
        assert sensor.describe_status(0x8001)[1] == "bit 0: watchdog reset (a warning)"


@pytest.mark.parametrize("gage", range(6))
def test_a_gage_with_a_broken_cable_forbids_the_sample(gage):
    with connected(rated_wrench=(1e9,) * 6) as (emulator, sensor):
        emulator.faults = BoardFaults(broken_gages=(gage,))
        sensor.start()
        block = sensor.read(1.0)
    assert len(block)
    assert not block.usable.any()


def test_a_wrench_beyond_the_rated_range_is_not_usable():
    with connected(lambda _: np.array([140.0, 0, 0, 0, 0, 0])) as (_, sensor):
        sensor.start()
        assert not sensor.read(1.0).usable.any()


def test_other_traffic_on_the_bus_is_left_alone():
    with connected() as (emulator, sensor):
        sensor.start()
        with can.Bus(interface="virtual", channel=emulator.settings.channel) as stranger:
            for identifier in (0x100, 0x211, 0x7FF):
                stranger.send(can.Message(arbitration_id=identifier, data=bytes(8), is_extended_id=False))
            stranger.send(can.Message(arbitration_id=0x200, data=bytes(8), is_extended_id=True))
            blocks = read_for(sensor, 0.1)
        assert sensor.statistics().malformed == 0
    assert np.abs(np.concatenate([block.wrench for block in blocks]) - LOAD).max() < 0.2


def test_a_bus_that_is_not_there_is_unreachable():
    with pytest.raises(DeviceUnreachableError, match="cannot be opened"):
        NetCANOEM(NetCANOEMSettings(channel="no-such-can")).connect()


def test_a_bus_that_fails_is_told_by_the_next_read(monkeypatch):
    with connected() as (emulator, sensor):
        sensor.start()
        sensor.read(1.0)
        emulator.close()

        def fail(*_args, **_kwargs):
            raise can.CanOperationError("cable pulled")

        monkeypatch.setattr("can.interfaces.virtual.VirtualBus.send", fail)
        with pytest.raises(DeviceUnreachableError, match="cable pulled"):
            first_block(sensor, lambda _: False)
        monkeypatch.undo()


def test_a_faster_bus_may_be_polled_faster():
    assert NetCANOEMSettings(channel="can0", bitrate=1_000_000, rate_hz=3200.0).rate_hz == 3200.0
