"""Where a search begins for an anchor that is loose: among all stretches of the rim, each at its full size."""

from dataclasses import replace

import numpy as np
import pytest
from effect_cases import there_and_back
from numpy.typing import NDArray

from estimator.diagnosis.fitting.case import Case, linearise
from estimator.diagnosis.fitting.releases import starts_at_full_size
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import mechanics_of, solve_case
from estimator.diagnosis.noise.correlated_errors import correlated_errors_of
from estimator.diagnosis.noise.estimation import Noise
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.effect import Values
from estimator.effects.mounting.anchor_debonding import ANCHOR_DEBONDING, ANCHOR_PEELING
from estimator.experiment import Box, Experiment
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment

FloatArray = NDArray[np.float64]

COARSE = Grading(grasp_m=6e-3, anchor_m=8e-3, largest_m=20e-3, growth=3.0, layers=1)
BASE = Hypothesis(1e4, 0.4)


def way_out(every: int) -> Experiment:
    """The way out alone, one row in so many."""
    whole, rows = there_and_back().experiment, slice(None, 21, every)
    return replace(
        whole,
        time=whole.time[rows],
        phase=whole.phase[rows],
        step=whole.step[rows],
        position=whole.position[rows],
        quaternion_wxyz=whole.quaternion_wxyz[rows],
        wrench=whole.wrench[rows],
        fiducials=whole.fiducials[rows],
    )


ONE_SIDE = way_out(every=5)
OTHER_SIDE = Box((-0.0501, 0.0499, -0.0051), (0.0501, 0.0501, 0.0051))
TWO_SIDES = replace(ONE_SIDE, anchors=(*ONE_SIDE.anchors, OTHER_SIDE))


def case_of(experiment: Experiment, loose: Values) -> Case:
    """An experiment as it is measured, without noise, where a stretch of the anchors is loose."""
    problem, rows = mesh_experiment(experiment, COARSE), len(experiment.time)
    setup = Setup((experiment,), problem, (GripLoad.none(rows),))

    def solved(hypothesis: Hypothesis) -> tuple[FloatArray, FloatArray]:
        (solution,) = solve_case(setup, hypothesis)
        mechanics = mechanics_of(solution)
        of_row = solution.load_steps.of_row
        return mechanics.wrench[of_row], mechanics.fiducials[of_row]

    wrench, fiducials = solved(BASE.with_effect(ANCHOR_DEBONDING, loose))
    seen = replace(experiment, wrench=wrench, fiducials=fiducials)
    (baseline,) = solve_case(setup, BASE)
    zeros = np.zeros((rows, 6 + 3 * len(experiment.fiducials_rest)))
    shared = correlated_errors_of(mechanics_of(baseline), zeros, Noise(), DiagnosisSettings().noise)
    return Case((seen,), problem, setup.loads, (zeros,), (shared.whitening(),))


@pytest.mark.parametrize(
    ("experiment", "first", "last"),
    [
        (ONE_SIDE, 0.1, 0.45),
        (ONE_SIDE, 0.55, 1.0),
        (TWO_SIDES, 0.1, 0.3),
        (TWO_SIDES, 0.75, 0.95),
        (TWO_SIDES, 0.4, 0.65),
    ],
    ids=["inside one side", "to its end", "inside the second", "inside the first", "round the corner"],
)
def test_it_begins_at_the_stretch_that_is_loose(experiment: Experiment, first: float, last: float) -> None:
    loose = {"share": last - first, "place": first / (1.0 - (last - first))}
    case = case_of(experiment, loose)
    (start,) = starts_at_full_size(case, linearise(case, BASE), ANCHOR_DEBONDING, 1)
    (found,) = start.values
    begins = found["place"] * (1.0 - found["share"])
    assert begins == pytest.approx(first, abs=0.06)
    assert begins + found["share"] == pytest.approx(last, abs=0.06)


def test_what_has_no_size_to_look_over_begins_nowhere() -> None:
    case = case_of(ONE_SIDE, {"share": 0.3, "place": 0.5})
    assert ANCHOR_PEELING.looked_over() == []
    assert starts_at_full_size(case, linearise(case, BASE), ANCHOR_PEELING, 2) == []
