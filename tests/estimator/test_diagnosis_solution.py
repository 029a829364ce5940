"""A case solved under a hypothesis, one experiment after the other."""

import numpy as np
import pytest
from effect_cases import there_and_back
from numpy.typing import NDArray

from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import mechanics_of, solve_case
from estimator.diagnosis.sensitivity.readings import channels, predicted_readings
from estimator.effects.effect import Effect, Values
from estimator.effects.mounting.support_friction import SUPPORT_FRICTION
from estimator.effects.tissue.permanent_set import PERMANENT_SET
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment

COARSE = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=30e-3, growth=3.0, layers=1)
TABLE = {"coefficient": 0.5, "contact": 0.0, "adhesion": 40.0, "elastic_slip": 2e-4}


def twice_the_same(effect: Effect, values: Values) -> list[NDArray[np.float64]]:
    """What the sensors read (n, 6 + 3m) of one retraction and of its repeat."""
    experiments = [there_and_back(order=order).experiment for order in (1, 2)]
    hypothesis = Hypothesis(1e4, 0.45).with_effect(effect, values)
    nothing = [GripLoad.none(len(one.time)) for one in experiments]
    solutions = solve_case(Setup(experiments, mesh_experiment(experiments[0], COARSE), nothing), hypothesis)
    return [
        channels(predicted_readings(mechanics_of(solution), hypothesis, np.zeros((46, 6 + 48))))
        for solution in solutions
    ]


def test_a_phantom_laid_down_anew_answers_alike_each_time() -> None:
    first, second = twice_the_same(SUPPORT_FRICTION[0], TABLE)
    assert second == pytest.approx(first, abs=1e-6)


@pytest.mark.parametrize(
    ("effect", "values"),
    [(SUPPORT_FRICTION[1], TABLE), (PERMANENT_SET, {"share": 0.2})],
    ids=["left lying", "permanent set"],
)
def test_what_a_retraction_leaves_behind_moves_the_beads_and_is_hidden_by_the_zero(
    effect: Effect, values: Values
) -> None:
    first, second = twice_the_same(effect, values)
    assert np.abs(second[0, 6:] - first[0, 6:]).max() > 2e-5
    assert second[0, :6] == pytest.approx(np.zeros(6), abs=1e-6)
    assert np.abs(first[-1, :6]).max() > 1e-3
