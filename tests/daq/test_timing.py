import numpy as np
import pytest

from daq.errors import SynchronisationError
from daq.timing.envelope import lower_envelope, lower_envelope_near
from daq.timing.event_times import estimate_event_times

ORIGIN_NS = 10**15


def jittered(true_ns: np.ndarray, seed: int, least_delay_ns: float = 20e3) -> np.ndarray:
    """Receive stamps: a least delay, an exponential one of 40 us, and a few of many milliseconds; none overtakes."""
    rng = np.random.default_rng(seed)
    delay = least_delay_ns + rng.exponential(40e3, len(true_ns))
    delay += (rng.random(len(true_ns)) < 0.002) * rng.exponential(10e6, len(true_ns))
    return np.maximum.accumulate(np.rint(true_ns + delay)).astype(np.int64)


@pytest.mark.parametrize("seed", range(5))
def test_a_counter_gives_event_times_within_a_tenth_of_a_millisecond(seed: int) -> None:
    counter = np.arange(20_000)
    true_ns = ORIGIN_NS + counter * 1e6 * (1 + 37e-6)
    times = estimate_event_times(counter, jittered(true_ns, seed))
    assert np.abs(times.time_ns - true_ns).max() < 0.1e6
    assert np.abs(times.time_ns - true_ns - 20e3).max() < 3e3  # all but the least delay, which nobody can see


def test_a_wandering_clock_is_followed_over_minutes() -> None:
    counter = np.arange(5 * 60 * 250)
    seconds = counter / 250
    wander_s = 1e-6 * 60 * np.sin(seconds / 60)  # the rate swings by 1 ppm
    true_ns = ORIGIN_NS + (seconds + wander_s) * 1e9
    times = estimate_event_times(counter, jittered(true_ns, seed=1))
    assert np.abs(times.time_ns - true_ns - 20e3).max() < 30e3
    assert 0.5 < times.wander_ppm < 4.0


def test_a_coarse_clock_is_taken_at_the_middle_of_its_tick() -> None:
    true_s = np.arange(60 * 250) * 0.004032
    host = jittered(ORIGIN_NS + true_s * 1e9, seed=2, least_delay_ns=0.0)
    times = estimate_event_times(np.floor(true_s * 1e3) * 1e-3, host, quantum=1e-3)
    error = times.time_ns - ORIGIN_NS - true_s * 1e9
    assert abs(error.mean()) < 20e3
    assert np.abs(error).max() < 0.55e6


@pytest.mark.parametrize("seed", range(5))
def test_few_late_messages_leave_a_clock_in_seconds_its_rate(seed: int) -> None:
    """A camera that sends five images a second for ten seconds, each up to some tens of milliseconds late."""
    true_s = np.arange(50) * 0.2
    late_s = np.random.default_rng(seed).gamma(3.0, 5e-3, len(true_s))
    host = np.rint(ORIGIN_NS + (true_s + late_s) * 1e9).astype(np.int64)
    times = estimate_event_times(true_s * (1 + 20e-6), host, unit_ns=1e9)
    error_ns = times.time_ns - ORIGIN_NS - true_s * 1e9
    assert np.ptp(error_ns) < 0.25e6


def test_many_prompt_messages_tell_the_rate_of_an_odd_clock() -> None:
    true_s = np.arange(60 * 250) * 0.004032
    times = estimate_event_times(true_s * 1.002, jittered(ORIGIN_NS + true_s * 1e9, seed=6), unit_ns=1e9)
    assert np.abs(times.time_ns - ORIGIN_NS - true_s * 1e9).max() < 0.1e6


def test_lost_samples_are_told_as_a_gap() -> None:
    counter = np.delete(np.arange(5000), np.arange(2000, 2050))
    times = estimate_event_times(counter, jittered(ORIGIN_NS + counter * 1e6, seed=3))
    assert times.gap_ends.tolist() == [2000]


def test_a_restarted_device_gets_a_clock_of_its_own() -> None:
    true_ns = ORIGIN_NS + np.concatenate([np.arange(3000), 5000 + np.arange(3000)]) * 1e6
    counter = np.concatenate([np.arange(3000), np.arange(3000)])
    times = estimate_event_times(counter, jittered(true_ns, seed=4))
    assert times.resets == 1
    assert np.abs(times.time_ns - true_ns).max() < 0.1e6


def test_samples_that_were_overtaken_are_no_new_clock_and_no_gap() -> None:
    true_s = np.arange(5000) * 0.004
    order = np.arange(5000)
    order[::20], order[1::20] = order[1::20].copy(), order[::20].copy()
    host = jittered(ORIGIN_NS + true_s[order] * 1e9, seed=7)
    times = estimate_event_times(true_s[order], host, unit_ns=1e9, counter=order)
    assert times.resets == 0
    assert len(times.gap_ends) == 0
    assert np.abs(times.time_ns - ORIGIN_NS - true_s[order] * 1e9).max() < 0.1e6


@pytest.mark.parametrize("few", [1, 2])
def test_a_last_sample_that_was_overtaken_is_no_new_clock(few: int) -> None:
    order = np.array([*range(3000), *range(3000 + few, 3000, -1)])
    host = jittered(ORIGIN_NS + np.arange(len(order)) * 4e6, seed=9)
    assert estimate_event_times(order * 0.004, host, unit_ns=1e9, counter=order).resets == 0


def test_a_clock_that_began_anew_just_before_the_end_is_seen() -> None:
    counter = np.array([*range(3000), 0, 1])
    host = jittered(ORIGIN_NS + np.arange(len(counter)) * 4e6, seed=9)
    assert estimate_event_times(counter * 0.004, host, unit_ns=1e9, counter=counter).resets == 1


@pytest.mark.parametrize("leap_s", [0.2, 3.0, 100.0])
def test_a_clock_that_leaps_ahead_is_mapped_apart_on_either_side(leap_s: float) -> None:
    counter = np.arange(3000)
    true_s = counter * 0.004
    device_s = true_s + leap_s * (counter >= 1000)
    times = estimate_event_times(
        device_s, jittered(ORIGIN_NS + true_s * 1e9, seed=8), unit_ns=1e9, counter=counter
    )
    assert times.resets == 1
    assert np.abs(times.time_ns - ORIGIN_NS - true_s * 1e9).max() < 0.1e6


def test_neither_a_pause_of_the_device_nor_late_messages_are_a_leap_of_its_clock() -> None:
    counter = np.arange(200)
    true_s = counter * 0.1 + 2.0 * (counter >= 100)  # it paused, and its counter with it
    late_s = np.where(counter % 50 < 20, 0.3, 0.001)  # twenty messages wait for the machine, again and again
    host = np.rint(ORIGIN_NS + (true_s + late_s) * 1e9).astype(np.int64)
    assert estimate_event_times(true_s, host, unit_ns=1e9, counter=counter).resets == 0


def test_a_clock_that_stands_leaves_the_receive_stamps() -> None:
    host = np.array([5, 7, 11]) + ORIGIN_NS
    assert estimate_event_times(np.full(3, -1), host).time_ns.tolist() == host.tolist()


def test_a_single_sample_has_no_clock() -> None:
    with pytest.raises(SynchronisationError, match="1 samples"):
        estimate_event_times(np.array([0]), np.array([ORIGIN_NS]))


def test_the_envelope_touches_the_cloud_from_below() -> None:
    rng = np.random.default_rng(5)
    x = np.sort(rng.uniform(-1, 1, 500))
    y = 3.0 + 0.5 * x + rng.exponential(1.0, 500)
    intercept, slope = lower_envelope(x, y)
    height = y - intercept - slope * x
    assert height.min() == pytest.approx(0.0, abs=1e-12)
    assert np.sum(height < 1e-9) >= 2
    assert (intercept, slope) == pytest.approx((3.0, 0.5), abs=0.05)


def test_a_usual_slope_is_kept_until_the_points_contradict_it() -> None:
    rng = np.random.default_rng(7)
    x = np.sort(rng.uniform(-1, 1, 500))
    y = 3.0 + 0.5 * x + rng.exponential(1.0, 500)
    intercept, slope = lower_envelope_near(x[::50], y[::50], usual=0.5, spread=1e-3)
    assert slope == 0.5
    assert (y[::50] - intercept - slope * x[::50]).min() == pytest.approx(0.0, abs=1e-12)
    _, contradicted = lower_envelope_near(x, y, usual=5.0, spread=1.0)
    assert contradicted == pytest.approx(0.5, abs=0.05)
