"""Cameras that take one bead for another, or read one at a false place."""

import numpy as np
import pytest
from effect_cases import measured, three_experiments
from numpy.testing import assert_allclose, assert_array_equal

from estimator.effects.vision.fiducial_mislabel import FiducialMislabel, FiducialMislabelWhereTurned
from estimator.effects.vision.fiducial_misread import (
    FiducialMisread,
    FiducialMisreadFrom,
    FiducialMisreadInPart,
    FiducialMisreadWithin,
)

TO_THE_LAST = (FiducialMislabel(), {"first": 3.0, "second": 7.0, "order": 2.0, "time": 42.0})


def exchanged_in(readings, rows, first, second):
    """What is seen where two beads are taken for each other in some rows."""
    seen = readings.fiducials.copy()
    seen[np.ix_(rows, [first, second])] = seen[np.ix_(rows, [second, first])]
    return measured(readings, seen + np.random.default_rng(1).normal(0, 2e-4, seen.shape))


def test_which_beads_are_exchanged_and_since_when_is_found_in_the_misfit():
    effect, constants = TO_THE_LAST
    noise = np.random.default_rng(1)
    baseline = []
    for readings in three_experiments():
        seen = effect.readings(readings, {**constants, "exchanged": 1.0}).fiducials
        baseline.append(measured(readings, seen + noise.normal(0, 2e-4, seen.shape)))
    assert effect.starts(baseline) == [pytest.approx(constants, abs=0.02)]


@pytest.mark.parametrize(
    "rows_of_each",
    {
        "within one experiment": ([], range(20, 46), []),
        "in a whole later experiment": ([], [], range(46)),
        "for a while": (range(10, 15), [], []),
        "now and then": ([3, 4, 5, 20], [0, 30, 45], [7]),
        "in every experiment from a time on": (range(30, 46),) * 3,
    }.values(),
)
def test_rows_in_which_two_beads_are_exchanged_show_by_themselves(rows_of_each):
    effect, pair = FiducialMislabelWhereTurned(), {"first": 5.0, "second": 6.0}
    each = [
        (readings, np.array(rows, dtype=int))
        for readings, rows in zip(three_experiments(), rows_of_each, strict=True)
    ]
    baseline = [exchanged_in(readings, rows, 5, 6) for readings, rows in each]
    assert effect.starts(baseline) == [pair]
    for seen, (readings, rows) in zip(baseline, each, strict=True):
        changed = effect.readings(seen, {**pair, "exchanged": 1.0}).fiducials
        assert_array_equal(np.flatnonzero((changed != readings.fiducials).any(axis=(1, 2))), rows)
        told = effect.sensor_steps(seen.experiment, {**pair, "exchanged": 1.0})
        time = seen.experiment.time
        inside = [any(a <= t <= b for a, b in (step["seconds"] for step in told)) for t in time]
        assert_array_equal(np.flatnonzero(inside), rows)


def test_an_exchanged_bead_shows_where_the_other_is_not_seen():
    effect, pair, rows = (
        FiducialMislabelWhereTurned(),
        {"first": 5.0, "second": 6.0, "exchanged": 1.0},
        [3, 20],
    )
    readings = three_experiments()[0]
    seen = exchanged_in(readings, rows, 5, 6)
    hidden = seen.experiment.fiducials.copy()
    hidden[:10, 5] = np.nan
    changed = effect.readings(measured(readings, hidden), pair).fiducials
    assert_array_equal(np.flatnonzero((changed != readings.fiducials).any(axis=(1, 2))), rows)


def test_beads_that_are_nowhere_exchanged_stay_as_they_are_read():
    effect = FiducialMislabelWhereTurned()
    for readings in [exchanged_in(each, [], 5, 6) for each in three_experiments()]:
        changed = effect.readings(readings, {"first": 5.0, "second": 6.0, "exchanged": 1.0})
        assert_array_equal(changed.fiducials, readings.fiducials)


def test_beads_are_exchanged_from_the_instant_on_and_in_later_experiments():
    effect, constants = TO_THE_LAST
    before, during, later = (
        effect.readings(readings, {**constants, "exchanged": 1.0}).fiducials - readings.fiducials
        for readings in three_experiments()
    )
    assert_array_equal(before, 0.0)
    assert_array_equal(np.flatnonzero(during.any(axis=(1, 2))), np.arange(11, 46))
    assert_array_equal(np.flatnonzero(later.any(axis=(0, 2))), [3, 7])
    # Beads 3 and 7 lie 20 mm apart along x.
    assert_allclose(later[:, 3], np.tile([0.02, 0.0, 0.0], (46, 1)), atol=1e-15)
    assert_allclose(later[:, 7], -later[:, 3])


def test_the_bead_that_is_read_at_a_false_place_is_found_and_when_it_began():
    noise = np.random.default_rng(2)
    constants = {"bead": 9.0, "order": 2.0, "time": 42.0}
    offset = {"offset_x": 1e-3, "offset_y": -5e-4, "offset_z": 0.0}
    effect, baseline = FiducialMisreadFrom(), []
    for readings in three_experiments():
        seen = effect.readings(readings, {**constants, **offset}).fiducials
        baseline.append(measured(readings, seen + noise.normal(0, 5e-5, seen.shape)))
    assert effect.starts(baseline)[0] == constants
    assert FiducialMisread().starts(baseline)[0] == {"bead": 9.0}


def test_a_bead_that_is_read_at_a_false_place_in_one_experiment_alone_is_found_with_that():
    noise = np.random.default_rng(3)
    constants = {"bead": 9.0, "order": 2.0}
    offset = {"offset_x": 1e-3, "offset_y": -5e-4, "offset_z": 0.0}
    effect, baseline = FiducialMisreadWithin(), []
    for readings in three_experiments():
        seen = effect.readings(readings, {**constants, **offset}).fiducials
        moved = np.flatnonzero((seen != readings.fiducials).any(axis=(0, 2)))
        assert_array_equal(moved, [9] if readings.experiment.order == 2 else [])
        baseline.append(measured(readings, seen + noise.normal(0, 5e-5, seen.shape)))
    assert effect.starts(baseline)[0] == constants


def test_a_bead_that_follows_its_tissue_in_part_is_found():
    noise = np.random.default_rng(4)
    effect, baseline = FiducialMisreadInPart(), []
    for readings in three_experiments():
        seen = effect.readings(readings, {"bead": 9.0, "share_behind": 0.05}).fiducials
        way = readings.fiducials[:, 9] - readings.experiment.fiducials_rest[9]
        assert_allclose(seen[:, 9] - readings.fiducials[:, 9], -0.05 * way, atol=1e-15)
        baseline.append(measured(readings, seen + noise.normal(0, 5e-5, seen.shape)))
    assert effect.starts(baseline)[0] == {"bead": 9.0}


def test_an_unseen_bead_does_not_hide_the_misread_one():
    readings = three_experiments()[0]
    seen = readings.fiducials.copy()
    seen[:, 4] = np.nan
    seen[:, 2, 1] += 1e-3
    assert FiducialMisread().starts([measured(readings, seen)])[0] == {"bead": 2.0}
