"""Accounting of RDT records: what is lost, doubled, late or of another stream, and the unwrapped counters."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.ati.rdt.sequence import SequenceTracker
from robot_drivers.protocols import StreamStatistics

TICKS = 7  # internal samples per record at 1000 Hz


def records(*rdt, first_ft=100, ticks=TICKS):
    """The records ``rdt`` of one stream whose record 1 was internal sample ``first_ft``."""
    return [(number % 2**32, (first_ft + ticks * (number - 1)) % 2**32) for number in rdt]


def place(tracker, pairs, at_s=0.0):
    """Place records that arrived together, at a time of the host clock."""
    rdt, ft = np.array(pairs, np.uint32).reshape(-1, 2).T
    return tracker.place(rdt, ft, np.full(len(rdt), round(at_s * 1e9)))


def run(*batches):
    tracker = SequenceTracker()
    placements = [place(tracker, batch) for batch in batches]
    return tracker.statistics, placements


def test_a_complete_stream_counts_from_1_and_loses_nothing():
    statistics, (first, second) = run(records(1, 2, 3), records(4, 5))
    assert statistics == StreamStatistics(received=5)
    assert first.counter.tolist() == [1, 2, 3]
    assert second.counter.tolist() == [4, 5]
    assert second.tick.tolist() == [121, 128]


def test_a_lost_record_is_counted_once():
    statistics, (placement,) = run(records(1, 2, 4, 5))
    assert statistics == StreamStatistics(received=4, lost=1)
    assert placement.counter.tolist() == [1, 2, 4, 5]


def test_records_lost_before_the_first_one_are_counted():
    statistics, _ = run(records(4, 5))
    assert statistics == StreamStatistics(received=2, lost=3)


def test_a_late_record_is_used_and_no_longer_lost():
    statistics, (placement,) = run(records(1, 2, 4, 3, 5))
    assert statistics == StreamStatistics(received=5, late=1)
    assert placement.index.tolist() == [0, 1, 2, 3, 4]
    assert placement.counter.tolist() == [1, 2, 4, 3, 5]
    assert placement.tick.tolist() == [100, 107, 121, 114, 128]


def test_a_record_that_comes_twice_is_used_once():
    statistics, (first, second) = run(records(1, 2, 3), records(3, 2, 4))
    assert statistics == StreamStatistics(received=4, duplicated=2)
    assert second.index.tolist() == [2]
    assert [*first.counter, *second.counter] == [1, 2, 3, 4]


def test_a_late_record_that_comes_twice_is_late_once():
    statistics, _ = run(records(1, 3, 2, 2, 4))
    assert statistics == StreamStatistics(received=4, late=1, duplicated=1)


@pytest.mark.parametrize("batch_size", [1, 3, 100])
def test_counters_go_on_where_32_bits_end(batch_size):
    tracker = SequenceTracker()
    # Four billion records are too many to give; steps of two billion, each confirmed by the next, get there.
    for number in (1, 2**31 - 5, 2**31 - 4, 2**32 - 10, 2**32 - 9):
        place(tracker, records(number, ticks=1, first_ft=0))
    lost = tracker.statistics.lost
    stream = records(*range(2**32 - 8, 2**32 + 8), ticks=1, first_ft=0)
    counters, ticks = [], []
    for start in range(0, len(stream), batch_size):
        placement = place(tracker, stream[start : start + batch_size])
        counters += placement.counter.tolist()
        ticks += placement.tick.tolist()
    assert counters == list(range(2**32 - 8, 2**32 + 8))
    assert ticks == [counter - 1 for counter in counters]
    assert tracker.statistics.lost == lost
    assert tracker.statistics.restarts == 0


def test_a_stream_started_again_on_request_counts_on_and_keeps_the_clock():
    tracker = SequenceTracker()
    place(tracker, records(1, 2, 3))
    tracker.expect_start()
    placement = place(tracker, records(1, 2, first_ft=1000))
    assert placement.counter.tolist() == [4, 5]
    assert placement.tick.tolist() == [1000, 1007]
    assert tracker.statistics == StreamStatistics(received=5, restarts=1)


@pytest.mark.parametrize("first_ft", [50, 90_000])
def test_a_box_powered_up_again_counts_on_and_its_clock_begins_a_new_epoch(first_ft):
    """Also where the box has meanwhile been up for longer than it had been before (90 000 ticks, 13 s)."""
    tracker = SequenceTracker()
    place(tracker, records(1, 2, 3, first_ft=70_000))
    tracker.expect_start()
    placement = place(tracker, records(1, 2, first_ft=first_ft), at_s=20.0)
    assert placement.counter.tolist() == [4, 5]
    assert placement.tick.tolist() == [0, 7]
    assert tracker.statistics == StreamStatistics(received=5, restarts=1)


def test_a_stream_started_again_after_a_long_silence_of_the_network_keeps_its_clock():
    tracker = SequenceTracker()
    place(tracker, records(1, 2, 3, first_ft=70_000))
    tracker.expect_start()
    placement = place(tracker, records(1, first_ft=70_000 + 140_000), at_s=20.0)
    assert placement.tick.tolist() == [210_000]


def test_a_restart_is_recognised_when_its_first_records_are_lost():
    tracker = SequenceTracker()
    place(tracker, records(1, 2, 3, first_ft=70_000))
    tracker.expect_start()
    placement = place(tracker, records(4, 5, first_ft=50))
    assert placement.counter.tolist() == [7, 8]
    assert tracker.statistics == StreamStatistics(received=5, lost=3, restarts=1)


def test_a_request_that_restarts_nothing_changes_nothing():
    tracker = SequenceTracker()
    place(tracker, records(1, 2, 3))
    tracker.expect_start()
    placement = place(tracker, records(4, 6, 5, 6))
    assert placement.counter.tolist() == [4, 6, 5]
    assert tracker.statistics == StreamStatistics(received=6, late=1, duplicated=1)


def test_a_restart_that_nobody_asked_for_needs_a_second_record():
    statistics, (_, placement) = run(records(*range(1, 101)), records(40, 41, 42, first_ft=5000))
    assert placement.counter.tolist() == [102, 103]
    assert statistics == StreamStatistics(received=102, lost=1, restarts=1)


def test_a_long_silence_of_the_network_is_a_loss_and_not_a_restart():
    statistics, (_, placement) = run(records(1, 2, 3), records(100_000, 100_001, 100_002))
    assert placement.counter.tolist() == [100_001, 100_002]
    assert statistics == StreamStatistics(received=5, lost=100_000 - 3)


def test_rubbish_of_a_records_length_is_not_used():
    rubbish = [(0xDEADBEEF, 0x12345678)]
    statistics, (placement,) = run(records(1, 2) + rubbish + records(3, 4))
    assert placement.index.tolist() == [0, 1, 3, 4]
    assert statistics == StreamStatistics(received=4, malformed=1)


def test_a_number_that_fits_with_a_clock_that_does_not_is_not_used():
    statistics, (placement,) = run([*records(1, 2), (5, 0xF0000000), *records(3)])
    assert placement.counter.tolist() == [1, 2, 3]
    assert statistics == StreamStatistics(received=3, malformed=1)


def test_a_far_record_out_of_the_streams_pace_waits_for_a_second_one():
    pairs = records(1, 2, 3)
    rubbish = (900, pairs[-1][1] + 50 * 897 * TICKS)
    statistics, (placement,) = run([*pairs, rubbish, *records(4, first_ft=pairs[-1][1] + TICKS)])
    assert placement.counter.tolist() == [1, 2, 3, 4]
    assert statistics == StreamStatistics(received=4, malformed=1)


def test_an_empty_batch_places_nothing():
    tracker = SequenceTracker()
    for _ in range(2):
        assert len(place(tracker, []).counter) == 0
        place(tracker, records(1))


@st.composite
def disturbed_streams(draw):
    """A stream with losses, doubles and neighbours exchanged, cut into batches, and what happened to it."""
    fate = st.sampled_from(["pass"] * 6 + ["lose", "double", "exchange"])
    fates = draw(st.lists(fate, min_size=1, max_size=60))
    sent, happened, overtaken = [], {"lose": 0, "double": 0, "exchange": 0}, None
    for number, what in enumerate([*fates, "pass"], start=1):
        if what == "lose":
            happened["lose"] += 1
            continue
        if what == "exchange" and overtaken is None:
            overtaken = number
            continue
        sent += [number, number] if what == "double" else [number]
        happened["double"] += what == "double"
        if overtaken is not None:
            sent.append(overtaken)
            happened["exchange"] += 1
            overtaken = None
    cuts = sorted(draw(st.lists(st.integers(0, len(sent)), max_size=5)))
    batches = [sent[a:b] for a, b in zip([0, *cuts], [*cuts, len(sent)], strict=True)]
    return batches, happened


@given(disturbed_streams(), st.integers(0, 2**32 - 1), st.sampled_from([1, 7, 7000]))
def test_every_disturbance_is_counted_exactly_however_the_stream_is_cut(stream, first_ft, ticks):
    batches, happened = stream
    statistics, placements = run(*(records(*batch, first_ft=first_ft, ticks=ticks) for batch in batches))
    delivered = np.concatenate([placement.counter for placement in placements])
    sent = [number for batch in batches for number in batch]
    assert sorted(delivered) == sorted(set(sent))
    assert statistics == StreamStatistics(
        received=len(delivered),
        lost=happened["lose"],
        duplicated=happened["double"],
        late=happened["exchange"],
    )


@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1)), max_size=50))
def test_whatever_arrives_is_accounted_for(pairs):
    tracker = SequenceTracker()
    placement = place(tracker, pairs)
    statistics = tracker.statistics
    assert len(placement.counter) == statistics.received
    assert statistics.lost >= 0
    assert statistics.received + statistics.duplicated + statistics.malformed <= len(pairs)
    assert (np.diff(placement.index) > 0).all()
    assert len(set(placement.counter.tolist())) == len(placement.counter)
