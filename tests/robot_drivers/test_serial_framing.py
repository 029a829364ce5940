"""Records found in damaged byte streams: nothing wrong is delivered, and little that is right is withheld."""

import struct
import time

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from robot_drivers.ati.digital_ft.protocol import SAMPLE_SIZE, SampleDecoder, checksum_holds
from robot_drivers.ati.serial.framing import FrameSynchroniser

GUARD = 4
GOLDEN_GAGES = (1, 2, 3, -4, 5, -6)
GOLDEN = bytes.fromhex("0001 0003 0005 0002 FFFC FFFA 7F")


def sample(gages, error=False):
    """The 13 bytes of a sample, from the byte table."""
    content = struct.pack(">6h", *(int(gages[i]) for i in (0, 2, 4, 1, 3, 5)))
    return content + bytes([(sum(content) & 0x7F) | (0x80 if error else 0)])


def stream(gages):
    return b"".join(sample(row) for row in gages)


def wild(n, seed=0):
    """Gages without any relation between samples."""
    return np.random.default_rng(seed).integers(-32768, 32768, (n, 6))


def at_rest(n, seed):
    """Gages of a sensor at rest: any offset, one count of noise."""
    random = np.random.default_rng(seed)
    return np.rint(random.integers(-20000, 20000, 6) + random.standard_normal((n, 6))).astype(int)


def decoded(data, chunks=(364,)):
    """Values, status, index and end of all samples that a decoder gives for data fed in such chunks, repeatedly."""
    decoder, found, position, turn = SampleDecoder(), [], 0, 0
    while position < len(data):
        size = chunks[turn % len(chunks)]
        found.append(decoder.feed(data[position : position + size]))
        position, turn = position + size, turn + 1
    columns = (
        np.concatenate([getattr(r, name) for r in found]) for name in ("values", "status", "index", "end")
    )
    return *columns, decoder.damages


def sent_earlier(delivered, gages):
    """Whether the delivered values are a subsequence of those sent."""
    rows = iter(map(tuple, gages.tolist()))
    return all(any(value == row for row in rows) for value in map(tuple, delivered.tolist()))


def test_a_sample_is_decoded_as_the_byte_table_says():
    assert sample(GOLDEN_GAGES) == GOLDEN
    values, status, index, end, _ = decoded(GOLDEN * (GUARD + 2))
    np.testing.assert_array_equal(values, [GOLDEN_GAGES] * 2)
    np.testing.assert_array_equal(status, [0, 0])
    np.testing.assert_array_equal(index, [0, 1])
    np.testing.assert_array_equal(end, [13, 26])


def test_the_top_bit_of_the_last_byte_is_the_status():
    _, status, *_ = decoded(sample(GOLDEN_GAGES, error=True) + GOLDEN * (GUARD + 1))
    np.testing.assert_array_equal(status, [1, 0])


def test_the_checksum_sees_every_change_of_a_byte_but_for_its_top_bit():
    original = np.frombuffer(GOLDEN, np.uint8)
    for position in range(SAMPLE_SIZE):
        changed = np.tile(original, (256, 1))
        changed[:, position] ^= np.arange(256, dtype=np.uint8)
        np.testing.assert_array_equal(np.flatnonzero(checksum_holds(changed)), [0, 0x80])


def test_a_sound_stream_comes_through_whole_but_for_the_last_few():
    gages = wild(500)
    values, _, index, end, damages = decoded(stream(gages))
    np.testing.assert_array_equal(values, gages[:-GUARD])
    np.testing.assert_array_equal(index, np.arange(500 - GUARD))
    np.testing.assert_array_equal(end, 13 * (index + 1))
    assert damages == 0


EDITS = st.lists(
    # Bytes since the edit before, kind, size. Edits that leave the length of one record as it was (several in it,
    # or whole records lost) are what the checksum alone guards against: they are a test of their own.
    st.tuples(
        st.integers(80, 200),
        st.sampled_from(["lose", "insert", "change"]),
        st.integers(1, 40).filter(lambda size: size % 13),
    ),
    max_size=6,
)


def edited(data, edits, random):
    """Bytes with edits from front to back; inserted ones are random."""
    edited, position = bytearray(data), 0
    for distance, what, size in edits:
        position += distance
        if what == "lose":
            del edited[position : position + size]
        elif what == "insert":
            edited[position:position] = random.bytes(size)
        else:  # in its lower bits: the top bit escapes any checksum of seven bits
            edited[position] ^= 1 + size % 127
    return bytes(edited)


@settings(max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    edits=EDITS,
    chunks=st.lists(st.integers(1, 200), min_size=1, max_size=5),
)
@example(seed=0, edits=[(0, "lose", 1)], chunks=[1])
@example(seed=0, edits=[(0, "insert", 5), (117, "lose", 5)], chunks=[7])
def test_whatever_happens_to_the_bytes_only_samples_that_were_sent_are_delivered(seed, edits, chunks):
    gages = wild(150, seed)
    data = edited(stream(gages), edits, np.random.default_rng(seed + 1))
    values, _, index, end, damages = decoded(data, chunks)
    assert sent_earlier(values, gages)
    assert (np.diff(index) > 0).all()
    assert (np.diff(end) > 0).all()
    assert damages <= len(edits)
    # the undamaged rest of the stream is found again
    np.testing.assert_array_equal(values[-1], gages[-1 - GUARD])


@settings(max_examples=50)
@given(
    seed=st.integers(0, 2**32 - 1), edits=EDITS, chunks=st.lists(st.integers(1, 200), min_size=1, max_size=5)
)
def test_the_result_does_not_depend_on_how_the_bytes_are_cut(seed, edits, chunks):
    data = edited(stream(wild(150, seed)), edits, np.random.default_rng(seed + 1))
    at_once, in_pieces = decoded(data, [len(data)]), decoded(data, chunks)
    for name, one, other in zip(("values", "status", "index", "end"), at_once, in_pieces, strict=False):
        np.testing.assert_array_equal(one, other, err_msg=name)


@settings(max_examples=50)
@given(data=st.binary(max_size=3000), chunks=st.lists(st.integers(1, 200), min_size=1, max_size=5))
def test_rubbish_raises_nothing(data, chunks):
    decoded(GOLDEN * 3 + data, chunks)


def test_one_in_128_of_two_samples_fused_into_one_is_not_seen():
    fused = 0
    for seed in range(2000):
        data = stream(wild(20, seed))
        values, *_ = decoded(data[: 10 * 13 + 6] + data[11 * 13 + 6 :])
        fused += not sent_earlier(values, wild(20, seed))
    assert fused == pytest.approx(2000 / 128, abs=12)  # three standard deviations


@pytest.mark.parametrize("lost", range(1, 13))
def test_lost_bytes_cost_the_damaged_sample_and_its_guards_and_are_counted(lost):
    gages = wild(60)
    data = stream(gages)
    data = data[: 30 * 13 + 5] + data[30 * 13 + 5 + lost :]
    values, _, index, _, damages = decoded(data)
    # the loss may reach into the next sample; a guard may be hit by chance once more
    damaged = 1 + (5 + lost > 13)
    np.testing.assert_array_equal(values, gages[index])
    missing = sorted(set(range(60 - GUARD)) - set(index.tolist()))
    assert missing == list(range(30 - GUARD, 30 + damaged + GUARD))
    assert damages == 1


def wrongly_delivered(guard, events):
    """How many samples that were never sent come through when single bytes are lost, at rest, seeded."""
    wrong = 0
    for seed in range(events):
        gages = at_rest(60, seed)
        data = bytearray(stream(gages))
        del data[np.random.default_rng(seed).integers(20 * 13, 30 * 13)]
        synchroniser = FrameSynchroniser(SAMPLE_SIZE, checksum_holds, guard)
        content = synchroniser.feed(bytes(data)).content.tobytes()
        sent = {sample(row) for row in gages}
        wrong += sum(content[i : i + 13] not in sent for i in range(0, len(content), 13))
    return wrong


def test_neighbours_that_hold_too_keep_false_samples_out():
    assert wrongly_delivered(guard=0, events=1000) > 2
    assert wrongly_delivered(guard=GUARD, events=500) == 0


def test_nothing_is_delivered_while_two_alignments_hold():
    decoder = SampleDecoder()
    decoder.feed(GOLDEN * 5)
    assert len(decoder.feed(b"\x01" + bytes(13 * 100)).index) == 0  # zeros hold at every alignment
    gages = wild(40)
    delivered = decoder.feed(stream(gages)).values
    assert len(delivered) > 20
    assert sent_earlier(delivered, np.vstack([np.zeros((200, 6), int), gages]))


def test_an_endless_fault_does_not_pile_up_bytes():
    decoder = SampleDecoder()
    random = np.random.default_rng(3)
    begin = time.process_time()
    for _ in range(1000):  # four seconds of the line
        decoder.feed(random.bytes(364))
    assert time.process_time() - begin < 2.0


def test_it_keeps_up_with_seven_kilohertz():
    decoder, data = SampleDecoder(), stream(wild(7000))
    begin = time.process_time()
    received = sum(len(decoder.feed(data[i : i + 364]).index) for i in range(0, len(data), 364))
    assert received == 7000 - GUARD
    assert time.process_time() - begin < 0.3
