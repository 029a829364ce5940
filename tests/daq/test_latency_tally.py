import math

import numpy as np
import pytest

from daq.session.latency import LatencyTally


def test_quantiles_are_told_within_the_width_of_a_bin() -> None:
    durations = np.random.default_rng(0).exponential(3e-3, 20_000)
    tally = LatencyTally()
    for duration in durations:
        tally.add(duration)
    assert tally.count == 20_000
    assert tally.longest_s == durations.max()
    for share in (0.5, 0.95, 0.999):
        assert tally.quantile_s(share) == pytest.approx(np.quantile(durations, share), rel=0.08)
    assert tally.quantile_s(1.0) == durations.max()


def test_durations_beyond_the_bins_still_count() -> None:
    tally = LatencyTally()
    for duration in (0.0, 1e-9, 1e4):
        tally.add(duration)
    assert tally.count == 3
    assert tally.longest_s == 1e4


def test_without_a_duration_there_is_no_quantile() -> None:
    assert math.isnan(LatencyTally().quantile_s(0.5))
