"""The lag between two signals of one motion: error, standard deviation and correlation."""

import numpy as np
import pytest

from daq.errors import SynchronisationError
from daq.timing.latency import estimate_latency, main_motion


def sway(time_s: np.ndarray) -> np.ndarray:
    """2.5 mm to and fro at 1.1 Hz, in straight lines."""
    return 2.5e-3 * (2.0 * np.abs(2.0 * ((1.1 * time_s) % 1.0) - 1.0) - 1.0)


ROBOT_S = np.arange(0.0, 12.0, 0.004032)


@pytest.mark.parametrize("lag_s", [-0.06, 0.0, 0.0123, 0.11])
def test_a_late_force_is_found_to_a_tenth_of_a_millisecond(lag_s: float) -> None:
    rng = np.random.default_rng(1)
    time_s = np.arange(0.0, 12.0, 1e-3)
    force = -110.0 * sway(time_s - lag_s) + 4.0 + 0.01 * time_s + rng.normal(0.0, 6e-3, len(time_s))
    found = estimate_latency(ROBOT_S, sway(ROBOT_S), time_s, force)
    assert found.lag_s == pytest.approx(lag_s, abs=1e-4)
    assert found.std_s < 1e-4
    assert found.lags_s[found.correlation.argmax()] == pytest.approx(lag_s, abs=1.5e-3)
    assert found.explained > 0.99


def test_the_standard_deviation_is_that_of_repeated_estimates() -> None:
    time_s = np.arange(0.03, 12.0, 0.2)
    lags, stds = [], []
    for seed in range(30):
        noise = np.random.default_rng(seed).normal(0.0, 1e-4, len(time_s))
        found = estimate_latency(ROBOT_S, sway(ROBOT_S), time_s, 0.7 * sway(time_s - 0.043) + noise)
        lags.append(found.lag_s)
        stds.append(found.std_s)
    assert np.mean(lags) == pytest.approx(0.043, abs=5e-4)
    assert np.std(lags) == pytest.approx(np.sqrt(np.mean(np.square(stds))), rel=0.5)


def test_a_part_that_hardly_moves_does_not_spoil_the_standard_deviation() -> None:
    time_s = np.arange(0.03, 12.0, 0.04)
    halting = np.where((ROBOT_S > 4.0) & (ROBOT_S < 7.0), 0.0, sway(ROBOT_S))
    late = np.interp(time_s - 0.043, ROBOT_S, halting)
    late += np.random.default_rng(3).normal(0.0, 1e-5, len(time_s))
    found = estimate_latency(ROBOT_S, halting, time_s, late)
    assert found.lag_s == pytest.approx(0.043, abs=5e-4)
    assert found.std_s < 5e-4


def test_a_bent_signal_keeps_its_lag() -> None:
    time_s = np.arange(0.0, 12.0, 1e-3)
    way = 400.0 * sway(time_s - 0.02)
    found = estimate_latency(ROBOT_S, sway(ROBOT_S), time_s, way + 0.2 * way**2 + 0.1 * way**3)
    assert found.lag_s == pytest.approx(0.02, abs=1e-4)


def test_the_main_motion_is_that_along_which_most_happens() -> None:
    way = sway(ROBOT_S)
    samples = np.outer(way, [0.6, 0.0, 0.8]) + np.array([1.0, 2.0, 3.0])
    assert np.abs(np.corrcoef(main_motion(samples), way)[0, 1]) == pytest.approx(1.0)


def test_what_does_not_move_or_is_too_short_has_no_lag() -> None:
    time_s = np.arange(0.0, 12.0, 1e-3)
    with pytest.raises(SynchronisationError, match="move for longer"):
        estimate_latency(ROBOT_S, sway(ROBOT_S), time_s, np.zeros(len(time_s)))
    with pytest.raises(SynchronisationError, match="20 samples"):
        estimate_latency(ROBOT_S, sway(ROBOT_S), time_s[1000:1020], sway(time_s[1000:1020]))
