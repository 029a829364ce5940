"""What a score counts: shares, medians, and whether answers are right as often as they claim."""

import math

import numpy as np
import pytest

from estimator.blind.scoring.intervals import calibration_error, calibration_error_by_chance, quantile, share
from estimator.blind.scoring.reliability import reliability


def test_shares_have_wilsons_interval() -> None:
    # Wilson's interval of 8 in 10 by any table: 0.490 to 0.943
    figure = share([True] * 8 + [False] * 2)
    assert (figure.value, figure.count) == (0.8, 10)
    assert (figure.low, figure.high) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    nothing = share([])
    assert nothing.count == 0
    assert math.isnan(nothing.value)


def test_a_median_lies_within_its_interval_which_narrows_with_cases() -> None:
    few, many = quantile(range(1, 12), 50), quantile([n / 100 for n in range(1101)], 50)
    assert few.low <= few.value == 6.0 <= few.high
    assert many.high - many.low < few.high - few.low


def test_calibration_error_is_the_gap_between_claim_and_truth() -> None:
    sure_and_wrong_half_the_time = calibration_error([0.99] * 10, [True, False] * 5)
    assert sure_and_wrong_half_the_time.value == pytest.approx(0.49)
    honest = calibration_error([0.75] * 4 + [1.0] * 4, [True, True, True, False] + [True] * 4)
    assert honest.value == pytest.approx(0.0)


def test_answers_are_gathered_by_what_they_claim() -> None:
    found = reliability([0.6, 0.5, 0.98, 1.0, 0.97], [True, False, True, True, False])
    assert [(one.low, one.high, one.right.count) for one in found] == [
        (0.5, 0.7, 2),
        (0.9, 0.98, 1),
        (0.98, 1.0, 2),
    ]
    assert [one.claimed for one in found] == pytest.approx([0.55, 0.97, 0.99])
    assert [one.right.value for one in found] == [0.5, 0.0, 1.0]


def test_few_answers_show_a_calibration_error_even_if_they_are_right_as_often_as_they_claim() -> None:
    # One answer at a half is off by a half; n at a half, by the mean absolute deviation of the binomial over n.
    assert calibration_error_by_chance([0.5]) == pytest.approx(0.5)
    assert calibration_error_by_chance([0.5] * 100) == pytest.approx(
        np.sqrt(0.25 / 100 * 2 / np.pi), rel=0.05
    )
    assert calibration_error_by_chance([1.0] * 5) == 0.0
    assert calibration_error_by_chance([]) is None
