"""A case solved on several workers."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from effect_cases import there_and_back

from estimator.diagnosis.fitting.case import Case, linearise
from estimator.diagnosis.fitting.parallel import solved_by
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import mechanics_of, solve_case
from estimator.diagnosis.noise.correlated_errors import correlated_errors_of
from estimator.diagnosis.noise.estimation import Noise
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE
from estimator.effects.effect import Effect, Values
from estimator.effects.force.torque_centre import TorqueCentre
from estimator.effects.mounting.anchor_debonding import ANCHOR_DEBONDING, ANCHOR_PEELING
from estimator.effects.tissue.permanent_set import PERMANENT_SET
from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment

SETTINGS = DiagnosisSettings()

COARSE = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=30e-3, growth=3.0, layers=1)
MATERIAL = Hypothesis(1e4, 0.45)
A_THIRD_OFF = {"share": 0.3, "place": 0.5}


class Workers(ThreadPoolExecutor):
    """Counts what it is given to do."""

    given = 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.given += 1
        return super().submit(fn, *args, **kwargs)


def every_fourth_row(whole: Experiment) -> Experiment:
    of_rows = ("time", "phase", "step", "position", "quaternion_wxyz", "wrench", "fiducials")
    return replace(whole, **{name: getattr(whole, name)[::4] for name in of_rows})


@cache
def two_experiments() -> Case:
    experiments = tuple(every_fourth_row(there_and_back(order=order).experiment) for order in (1, 2))
    problem = mesh_experiment(experiments[0], COARSE)
    loads = tuple(GripLoad.none(len(one.time)) for one in experiments)
    mechanics = [mechanics_of(one) for one in solve_case(Setup(experiments, problem, loads), MATERIAL)]
    zeros = tuple(np.zeros((len(one.time), 6 + 3 * len(one.fiducials_rest))) for one in experiments)
    shared = [
        correlated_errors_of(one, zero, Noise(), SETTINGS.noise)
        for one, zero in zip(mechanics, zeros, strict=True)
    ]
    return Case(experiments, problem, loads, zeros, tuple(one.whitening() for one in shared))


def solved(effect: Effect, values: Values, material: Hypothesis = MATERIAL) -> int:
    """How many tasks workers were given for a hypothesis; what they find is what one finds alone."""
    case, hypothesis = two_experiments(), material.with_effect(effect, values)
    near = linearise(case, MATERIAL)
    with Workers(2) as workers:
        found = solved_by(workers)(case, hypothesis, near)
    alone = linearise(case, hypothesis, near)
    for one, other in zip(found.residual, alone.residual, strict=True):
        assert one == pytest.approx(other, abs=1e-9)
    for one, other in zip(found.jacobian, alone.jacobian, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9)
    assert len(found.known) == len(found.mechanics) == 2
    return workers.given


def test_experiments_are_solved_apart_where_nothing_is_remembered() -> None:
    assert solved(ANCHOR_DEBONDING, A_THIRD_OFF) == 2
    assert solved(ANCHOR_PEELING, {**A_THIRD_OFF, "order": 1.0, "begins": 0.5, "duration": 1.0}) == 2


@pytest.mark.parametrize("name", ["viscoelasticity:one_term", "support_friction:viscous"])
def test_so_are_those_at_whose_beginning_everything_is_forgotten(name: str) -> None:
    effect = next(one for one in CATALOGUE if one.name == name)
    constants = {one.name: one.grid[0] for one in effect.constants}
    assert solved(effect, {**constants, **{one.name: 0.3 * one.scale for one in effect.amplitudes}}) == 2


def test_they_are_solved_one_after_the_other_where_tissue_remembers() -> None:
    assert solved(PERMANENT_SET, {"share": 0.2}) == 1


def test_where_sensors_alone_err_there_is_nothing_to_solve_near_a_solution() -> None:
    effect = TorqueCentre("gripper")
    values = {amplitude.name: 1e-3 for amplitude in effect.amplitudes}
    assert solved(effect, values) == 0
    assert solved(effect, values, Hypothesis(1e4, 0.30)) == 2


def test_an_experiment_without_equilibrium_leaves_the_case_without_one() -> None:
    scaled = next(one for one in CATALOGUE if one.name == "motion_scale:translation")
    hypothesis = MATERIAL.with_effect(scaled, {"scale_error": -30.0})
    with Workers(2) as workers, pytest.raises(SolverError):
        solved_by(workers)(two_experiments(), hypothesis, None)
