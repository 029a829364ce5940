"""`retract check`: good experiments have nothing to say, and experiments of a case are compared."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from checked_experiments import GOOD, both_ways, graded, of_springs, there_and_back, written
from hypothesis import given, settings
from hypothesis import strategies as st
from spoiled_experiments import with_rows

from estimator.experiment import Environment, Experiment
from estimator.experiment.model import Weight
from estimator.experiment_checks import check_folder, findings_of
from estimator.fem.boundary.motion import GripperPose


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("path", [there_and_back, both_ways])
def test_a_good_experiment_has_nothing_to_say(path: Callable[[], list[GripperPose]], seed: int) -> None:
    assert findings_of(of_springs(path(), seed=seed)) == []


@given(
    kept=st.sets(st.integers(0, 5), min_size=0, max_size=6),
    beads_kept=st.sets(st.integers(0, 8), min_size=0, max_size=9),
    rows=st.integers(2, len(GOOD.time)),
    flat=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_what_is_not_measured_is_no_fault(
    kept: set[int], beads_kept: set[int], rows: int, flat: bool
) -> None:
    """Channels, beads and rows that are left out make nothing suspicious, as long as something is measured."""
    readings, points = GOOD.wrench.copy(), GOOD.fiducials.copy()
    readings[:, [axis for axis in range(6) if axis not in kept]] = np.nan
    points[:, [bead for bead in range(9) if bead not in beads_kept]] = np.nan
    if flat:
        points[:, :, 2] = np.nan
    less = with_rows(lambda _: list(range(rows)))(replace(GOOD, wrench=readings, fiducials=points))
    found = [finding for finding in findings_of(less) if finding.check != "what is measured"]
    assert found == []


def test_what_begins_under_load_may_stand_anywhere() -> None:
    later = of_springs(there_and_back()[3:])
    assert "start" in graded(later)
    assert graded(replace(later, first_row="under_load")) == {}


@pytest.mark.parametrize("weight", ["acts", "acts_after_first_row"])
def test_a_phantom_that_hangs_by_its_grasp_and_anchors_has_nothing_to_be_told(weight: Weight) -> None:
    """Where it acts from the first row on, beads hang below their places and forces are absolute."""
    hung = replace(
        GOOD,
        environment=Environment(surface_below="none", weight=weight),
        sensor=replace(GOOD.sensor, force_zero="no_load"),
    )
    if weight == "acts":
        hung = replace(
            hung,
            wrench=hung.wrench + np.array([0.0, 0.0, -0.09, 0.0, 0.0, 0.0]),
            fiducials=hung.fiducials + np.array([0.0, 0.0, -1e-3]),
        )
    assert graded(hung) == {}


@pytest.mark.parametrize(("share", "said"), [(0.5, True), (0.3, False), (1.0, False)])
def test_a_load_that_is_half_the_weight_is_pointed_out_where_the_weight_acts(
    share: float, said: bool
) -> None:
    weight = float(np.prod(GOOD.phantom.size_m)) * GOOD.phantom.density * 9.81
    load = np.full_like(GOOD.wrench, np.nan)
    load[:, :3] = np.outer(GOOD.step > 0, [0.0, 0.0, share * weight])
    sensor = replace(GOOD.sensor, orientation_std=0.01)
    environment = Environment(surface_below="none", weight="acts_after_first_row")
    hanging = replace(GOOD, driven="load", wrench=load, sensor=sensor, environment=environment)
    assert ("weight" in graded(hanging)) == said


def test_a_case_of_two_good_experiments_has_nothing_to_say(tmp_path: Path) -> None:
    written(GOOD, tmp_path / "case" / "a")
    written(replace(of_springs(both_ways(), seed=5), order=2), tmp_path / "case" / "b")
    assert [one.findings for one in check_folder(tmp_path / "case")] == [(), (), ()]


@pytest.mark.parametrize(
    ("second", "check", "grade"),
    [
        (replace(GOOD, order=2), "repeated experiments", "wrong"),
        (of_springs(there_and_back(), seed=5), "order of experiments", "suspicious"),
        (replace(of_springs(there_and_back(), seed=5), order=2, phantom_id="P02"), "one phantom", "wrong"),
    ],
)
def test_the_experiments_of_a_case_are_compared(
    tmp_path: Path, second: Experiment, check: str, grade: str
) -> None:
    written(GOOD, tmp_path / "case" / "a")
    written(second, tmp_path / "case" / "b")
    *members, together = check_folder(tmp_path / "case")
    assert [member.findings for member in members] == [(), ()]
    assert {finding.check: finding.grade for finding in together.findings} == {check: grade}
    assert together.findings[0].where.startswith("b/")
