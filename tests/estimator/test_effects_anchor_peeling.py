"""An anchor that comes off while an experiment runs."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK, straight_pull, with_rows
from scipy.spatial.transform import Rotation

from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import mechanics_of, solve_case
from estimator.diagnosis.search.refinements import accidents
from estimator.diagnosis.sensitivity.readings import predicted_readings
from estimator.effects.catalogue import default_catalogue
from estimator.effects.effect import Effect, Readings, Values
from estimator.effects.mounting.anchor_debonding import ANCHOR_DEBONDING, ANCHOR_PEELING
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment

FloatArray = NDArray[np.float64]
TINY = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=30e-3, growth=3.0, layers=1)
BASE = Hypothesis(12e3, 0.42)
OUT = straight_pull(REFERENCE_BLOCK, 0.006, 3)
REST = GripperPose(np.array(REFERENCE_BLOCK.grasp.centre), Rotation.identity())
# Out, a hold of four rows, and back.
POSES = [REST, *OUT, OUT[-1], OUT[-1], OUT[-1], *OUT[-2::-1], REST]
ROWS = len(POSES)
BLANK = with_rows(REFERENCE_BLOCK, POSES, np.zeros((ROWS, 6)), np.zeros((ROWS, 16, 3)))
EXPERIMENTS = [
    replace(BLANK, order=order, time=np.arange(ROWS, dtype=float), phase=("hold",) * ROWS)
    for order in (1, 2, 3)
]
PROBLEM = mesh_experiment(REFERENCE_BLOCK, TINY)
STRETCH = {"share": 0.3, "place": 1.0}
# All at once, between the second and the third row of the hold.
SUDDENLY = {**STRETCH, "order": 2.0, "begins": 4.4 / (ROWS - 1), "duration": 0.1}


def readings_under(effect: Effect, values: Values) -> list[Readings]:
    hypothesis = BASE.with_effect(effect, values)
    loads = [GripLoad.none(ROWS)] * len(EXPERIMENTS)
    solutions = solve_case(Setup(EXPERIMENTS, PROBLEM, loads), hypothesis)
    none = np.zeros((ROWS, 6 + 48))
    return [predicted_readings(mechanics_of(one), hypothesis, none) for one in solutions]


def pull(effect: Effect, values: Values) -> FloatArray:
    """The force along x in every row of all the experiments."""
    return np.concatenate([each.wrench[:, 0] for each in readings_under(effect, values)])


def test_before_the_instant_the_anchor_holds_and_from_then_on_the_stretch_is_off_for_good() -> None:
    whole, off = (pull(ANCHOR_DEBONDING, {**STRETCH, "share": share}) for share in (0.0, 0.3))
    peeled = pull(ANCHOR_PEELING, SUDDENLY)
    late = ROWS + 5
    scale = np.abs(whole).max()
    assert peeled[:late] == pytest.approx(whole[:late], abs=1e-4 * scale)
    assert peeled[late:] == pytest.approx(off[late:], abs=1e-4 * scale)
    assert np.abs(off - whole).max() > 0.02 * scale


def test_what_peels_slowly_lets_the_force_of_a_hold_fall_row_by_row() -> None:
    slowly = {**SUDDENLY, "begins": 3.0 / (ROWS - 1), "duration": 3.0}
    hold = pull(ANCHOR_PEELING, slowly)[ROWS + 3 : ROWS + 7]
    assert np.all(np.diff(np.abs(hold)) < 0.0)
    assert hold[-1] == pytest.approx(pull(ANCHOR_DEBONDING, STRETCH)[ROWS + 6], rel=1e-4)


def test_without_any_share_nothing_comes_off() -> None:
    nothing = {**SUDDENLY, "share": 0.0}
    assert pull(ANCHOR_PEELING, nothing) == pytest.approx(pull(ANCHOR_DEBONDING, nothing), abs=1e-12)


def seen_as(effect: Effect, values: Values) -> list[Readings]:
    """What the baseline predicts, beside beads measured as they move under an effect."""
    truth = readings_under(effect, values)
    attached = readings_under(ANCHOR_DEBONDING, {**STRETCH, "share": 0.0})
    return [
        replace(one, experiment=replace(one.experiment, fiducials=true.fiducials))
        for one, true in zip(attached, truth, strict=True)
    ]


def test_a_search_begins_about_the_row_from_which_the_beads_move_otherwise() -> None:
    starts = ANCHOR_PEELING.starts(seen_as(ANCHOR_PEELING, SUDDENLY))
    assert {start["place"] for start in starts} >= {0.0, 0.5, 1.0}
    for start in starts:
        assert start["order"] == 2.0
        middle = start["begins"] * (ROWS - 1) + start["duration"] / 2
        assert middle == pytest.approx(4.5, abs=0.5)


def test_it_is_not_searched_for_where_the_beads_move_otherwise_from_the_first_row_on() -> None:
    assert ANCHOR_PEELING.starts(seen_as(ANCHOR_DEBONDING, STRETCH)) == []


def test_it_is_an_accident_and_the_plain_form_is_none() -> None:
    assert ANCHOR_PEELING in accidents(default_catalogue())
    assert ANCHOR_DEBONDING not in accidents(default_catalogue())
