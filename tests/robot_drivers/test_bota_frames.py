"""The frames of a Bota sensor, cut out of whatever comes over the line."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.bota.frames import FRAME, STATUS_MAP, FrameDecoder, crc16_x25


def crc_of(content):
    return int(crc16_x25(np.frombuffer(content, np.uint8)[np.newaxis])[0])


def frame(time_us, wrench=(1, -2, 3, 0.25, -0.5, 0.125), status=0, temperature=30.0):
    return framed(struct.pack("<H6fIf", status, *wrench, time_us, temperature))


def framed(content):
    return b"\xaa" + content + struct.pack("<H", crc_of(content))


# ---- bytes


# the first is its check value in catalogues of CRCs
@pytest.mark.parametrize(("content", "crc"), [(b"123456789", 0x906E), (b"", 0x0000), (b"A", 0xA3F5)])
def test_the_crc_is_that_of_x25(content, crc):
    assert crc_of(content) == crc


def test_a_frame_is_read_as_its_layout_says():
    assert FRAME.itemsize == 37
    frames = FrameDecoder().feed(frame(5, status=2) + frame(1255))
    np.testing.assert_array_equal(frames.wrench, [[1, -2, 3, 0.25, -0.5, 0.125]] * 2)
    assert frames.status.tolist() == [2, 0]
    assert frames.time_us.tolist() == [5, 1255]
    assert frames.temperature_c.tolist() == [30.0, 30.0]
    assert frames.end.tolist() == [37, 74]


@given(st.binary(max_size=60).filter(lambda start: b"\xaa" not in start), st.integers(0, 300))
def test_a_stream_may_begin_anywhere_and_come_in_any_pieces(start, cut):
    sent = start + b"".join(frame(1250 * k) for k in range(8))
    decoder = FrameDecoder()
    found = [decoder.feed(piece) for piece in (sent[:cut], sent[cut:])]
    assert np.concatenate([part.time_us for part in found]).tolist() == [1250 * k for k in range(8)]
    assert np.concatenate([part.end for part in found]).tolist() == [
        len(start) + 37 * (k + 1) for k in range(8)
    ]


@given(st.integers(0, 36), st.integers(0, 7))
def test_a_changed_bit_costs_one_frame(place, bit):
    frames = [bytearray(frame(1250 * k)) for k in range(6)]
    frames[2][place] ^= 1 << bit
    decoder = FrameDecoder()
    assert decoder.feed(b"".join(frames)).time_us.tolist() == [0, 1250, 3750, 5000, 6250]
    assert decoder.damages == 1


def times_of(decoder, *pieces):
    return np.concatenate([decoder.feed(piece).time_us for piece in (b"", *pieces)]).tolist()


def one_by_one(data):
    return [data[place : place + 1] for place in range(len(data))]


@given(st.integers(0, 2**32 - 1), st.integers(1, 10_000), st.integers(2, 9), st.data())
def test_in_lock_a_frame_is_there_with_its_last_byte(clock, step, count, data):
    sent = [frame((clock + step * k) % 2**32) for k in range(count)]
    decoder = FrameDecoder()
    decoder.feed(sent[0])
    at_first = 0
    for number, one in enumerate(sent[1:], start=1):
        cut = data.draw(st.integers(0, 36))
        assert not len(decoder.feed(one[:cut]).end)
        found = decoder.feed(one[cut:]).end.tolist()
        assert found[-1] == 37 * (number + 1)
        at_first = at_first or len(found)
        assert len(found) == (2 if number == 1 else 1)


@given(
    st.lists(st.sampled_from(["kept", "cut", "torn", "followed by rubbish"]), min_size=2, max_size=14),
    st.data(),
)
def test_every_undamaged_frame_in_lock_is_kept_and_nothing_else_is_taken(fates, data):
    clock = data.draw(st.integers(0, 2**32 - 1))
    arrived, undamaged = b"", []
    for number, fate in enumerate(fates):
        one = frame((clock + 1250 * number) % 2**32)
        place, lost = data.draw(st.integers(0, 36)), data.draw(st.integers(1, 36))
        rubbish = data.draw(st.binary(min_size=1, max_size=80))
        arrived += {
            "kept": one,
            "cut": one[:place],
            "torn": one[:place] + one[place + lost :],
            "followed by rubbish": one + rubbish,
        }[fate]
        undamaged += [number] if fate in ("kept", "followed by rubbish") else []
    alone = [
        number
        for number in undamaged
        if not (fates[number] == "kept" and number + 1 in undamaged)
        and not (number - 1 in undamaged and fates[number - 1] == "kept")
    ]
    times = times_of(FrameDecoder(), *one_by_one(arrived))
    found = [(time - clock) % 2**32 // 1250 for time in times]
    assert times == [(clock + 1250 * number) % 2**32 for number in found]
    assert found == sorted(set(found))
    assert set(undamaged) - set(alone) <= set(found)


def torn_and_fitting(clock, place, lost):
    """A frame without ``lost`` bytes from ``place`` on, and one after it that fills it up to a stretch with its CRC."""
    whole = frame(clock)
    torn = whole[:place] + whole[place + lost :]
    begin = b"\xaa" + bytes(lost - 3)
    crc = struct.pack("<H", crc_of((torn + begin)[1:]))
    wrench = (begin[3:] + crc).ljust(24, b"\0")
    return torn, framed(bytes(2) + wrench + struct.pack("<If", clock + 1250, 30.0))


@given(st.integers(10_000, 2**32 - 10_000), st.integers(1, 31), st.data())
def test_a_misplaced_stretch_whose_crc_fits_is_not_taken_for_a_frame(clock, place, data):
    lost = data.draw(st.integers(5, min(27, 36 - place + 1)))
    before = [frame(clock - 1250 * k) for k in (3, 2, 1)]
    torn, second = torn_and_fitting(clock, place, lost)
    after = [frame(clock + 1250 * k) for k in (2, 3)]
    stretch = (torn + second)[:37]
    assert crc_of(stretch[1:35]) == struct.unpack("<H", stretch[35:])[0]
    times = times_of(FrameDecoder(), *before, torn, second, *after)
    assert times == [clock + 1250 * k for k in (-3, -2, -1, 1, 2, 3)]


@given(st.binary(min_size=30, max_size=30), st.integers(0, 2**32 - 1))
def test_rubbish_with_the_crc_of_a_frame_before_the_first_one_is_not_taken_for_one(content, clock):
    sent = [frame((clock + 1250 * k) % 2**32) for k in (0, 1, 2)]
    of_other_times = struct.pack("<I", (clock + 2**31) % 2**32)
    rubbish = framed(content[:26] + of_other_times + content[26:])
    assert times_of(FrameDecoder(), rubbish, *sent) == [(clock + 1250 * k) % 2**32 for k in (0, 1, 2)]


def test_a_frame_whose_last_byte_the_next_header_made_up_for_costs_nothing():
    clock = next(time for time in range(10_000, 20_000) if frame(time)[-1] == 0xAA)
    sent = [frame(clock + 1250 * k) for k in range(-3, 4)]
    arrived = b"".join([*sent[:3], sent[3][:-1], *sent[4:]])
    assert times_of(FrameDecoder(), arrived) == [clock + 1250 * k for k in range(-3, 4)]


@pytest.mark.parametrize("temperature", [float("nan"), float("inf"), 1e30])
def test_a_sensor_that_tells_no_temperature_is_heard(temperature):
    sent = [frame(1250 * k, temperature=temperature) for k in range(5)]
    assert times_of(FrameDecoder(), *sent) == [1250 * k for k in range(5)]


def test_a_sensor_that_begins_its_clock_anew_is_heard_a_frame_later():
    sent = [frame(time) for time in (9_000_000, 9_001_250, 1250, 2500, 3750)]
    decoder = FrameDecoder()
    assert [decoder.feed(one).time_us.tolist() for one in sent] == [
        [],
        [9_000_000, 9_001_250],
        [],
        [1250, 2500],
        [3750],
    ]


def test_the_status_is_told_in_words():
    assert STATUS_MAP.describe(0b1010) == (
        "bit 3: raw measurements, without the calibration",
        "bit 1: force or torque out of range",
    )
    assert STATUS_MAP.usable(np.array([0, 1, 2, 4, 8, 16])).tolist() == [True] + [False] * 5


# ---- the clock
