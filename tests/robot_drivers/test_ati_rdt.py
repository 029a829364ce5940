import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.ati.rdt import protocol as rdt
from robot_drivers.errors import ConfigurationError, DeviceProtocolError

GOLDEN_RECORD = bytes.fromhex(
    "00000001 00000007 00000000 000F4240 FFE17B80 003567E0 00000064 FFFFFF38 FFFFFFFF"
)


@pytest.mark.parametrize(
    ("command", "sample_count", "expected"),
    [
        (rdt.Command.STOP, 0, "12 34 00 00 00 00 00 00"),
        (rdt.Command.START_REAL_TIME, 0, "12 34 00 02 00 00 00 00"),
        (rdt.Command.START_REAL_TIME, 1000, "12 34 00 02 00 00 03 E8"),
        (rdt.Command.START_REAL_TIME, 0xFFFFFFFF, "12 34 00 02 FF FF FF FF"),
        (rdt.Command.START_BUFFERED, 0, "12 34 00 03 00 00 00 00"),
        (rdt.Command.RESET_LATCH, 0, "12 34 00 41 00 00 00 00"),
        (rdt.Command.SET_BIAS, 0, "12 34 00 42 00 00 00 00"),
    ],
)
def test_a_request_has_the_bytes_of_the_manual(command, sample_count, expected):
    assert rdt.request(command, sample_count) == bytes.fromhex(expected)


@pytest.mark.parametrize("sample_count", [-1, 2**32])
def test_a_sample_count_that_does_not_fit_is_refused(sample_count):
    with pytest.raises(ConfigurationError, match=str(sample_count)):
        rdt.request(rdt.Command.START_REAL_TIME, sample_count)


def test_a_limit_is_refused_in_buffered_mode_where_its_unit_is_not_defined():
    with pytest.raises(ConfigurationError, match="buffered"):
        rdt.request(rdt.Command.START_BUFFERED, 40)


def test_a_record_is_decoded_as_the_manual_lays_it_out():
    records = rdt.decode(GOLDEN_RECORD)
    assert records.rdt_sequence.tolist() == [1]
    assert records.ft_sequence.tolist() == [7]
    assert records.status.tolist() == [0]
    assert records.counts.tolist() == [[1_000_000, -2_000_000, 3_500_000, 100, -200, -1]]


def test_status_and_sequences_are_unsigned_and_counts_signed():
    records = rdt.decode(b"\xff" * 36)
    assert records.rdt_sequence.tolist() == [0xFFFFFFFF]
    assert records.ft_sequence.tolist() == [0xFFFFFFFF]
    assert records.status.tolist() == [0xFFFFFFFF]
    assert records.counts.tolist() == [[-1] * 6]


def test_records_of_several_datagrams_are_decoded_at_once_in_order():
    second = bytes.fromhex("00000002") + GOLDEN_RECORD[4:]
    records = rdt.decode(GOLDEN_RECORD + second)
    assert records.rdt_sequence.tolist() == [1, 2]
    assert records.counts.shape == (2, 6)


def test_a_datagram_holds_1_to_40_whole_records():
    assert min(rdt.DATAGRAM_SIZES) == 36
    assert max(rdt.DATAGRAM_SIZES) == 1440
    assert len(rdt.DATAGRAM_SIZES) == 40


@given(st.binary(max_size=36 * 41))
def test_any_bytes_are_either_decoded_whole_or_refused(payload):
    if len(payload) % 36:
        with pytest.raises(DeviceProtocolError, match=str(len(payload))):
            rdt.decode(payload)
    else:
        records = rdt.decode(payload)
        assert len(records.rdt_sequence) == len(payload) // 36
        again = b"".join(
            np.array(head, ">u4").tobytes() + counts.astype(">i4").tobytes()
            for *head, counts in zip(
                records.rdt_sequence, records.ft_sequence, records.status, records.counts, strict=True
            )
        )
        assert again == payload
