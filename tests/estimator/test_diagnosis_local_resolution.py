"""A named region is told on a mesh that follows it."""

from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from bare_contexts import bare_context
from retraction_cases import REFERENCE_BLOCK, follow, from_rest, recorded, straight_pull

from estimator.diagnosis.evidence.marginal_likelihood import error_borne_out
from estimator.diagnosis.fitting.case import linearise
from estimator.diagnosis.fitting.refit import refit
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.noise.errors_left import AT_MOST
from estimator.diagnosis.search.baseline import prepare
from estimator.diagnosis.search.candidate import Candidate, candidate_of
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.local_resolution import resolved
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE
from estimator.effects.effect import Effect
from estimator.experiment import Experiment, SensorNoise
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.observation import observe
from estimator.fit.settings import FitSettings
from estimator.forward.meshing import mesh_experiment

SETTINGS = DiagnosisSettings()

QUIET = replace(
    REFERENCE_BLOCK,
    sensor=SensorNoise(force_std=4e-3, torque_std=1e-4, fiducial_std=1e-5, position_std=6e-6),
)
PLAIN = Hypothesis(20e3, 0.42)
REGION = {"centre_x": -0.012, "centre_y": 0.008, "radius": 0.011, "log_stiffness_ratio": -0.9}


def effect(name: str) -> Effect:
    return next(one for one in CATALOGUE if one.name == name)


def pulled() -> Experiment:
    truth = PLAIN.with_effect(effect("inhomogeneity:cylinder"), REGION)
    fine = mesh_experiment(QUIET, Grading(1.5e-3, 4e-3, 6e-3, 2.0, 1))
    problem, poses = truth.problem(fine), from_rest(QUIET, straight_pull(QUIET, 0.015, 2))
    states = follow(problem, truth.material(), poses)
    return recorded(QUIET, poses, [observe(problem, one) for one in states], np.random.default_rng(5))


def pulls(candidate: Candidate) -> dict[str, float]:
    """By how many of its deviations each parameter of the region is off."""
    fit = candidate.fit
    return {
        c.key: (c.internal - c.at(REGION[c.key]).internal) / deviation
        for c, deviation in zip(fit.free_parameters, candidate.deviations, strict=True)
        if c.key in REGION
    }


@pytest.fixture(scope="module")
def workers() -> Iterator[Executor]:
    with ThreadPoolExecutor(2) as executor:
        yield executor


@pytest.fixture(scope="module")
def context(workers: Executor) -> Context:
    preparation, baseline = prepare([pulled()], SETTINGS, FitSettings(), workers)
    case = preparation.cases(AT_MOST)
    return replace(bare_context(baseline, case, error_borne_out(case, baseline)), executor=workers)


def test_a_region_is_as_large_and_as_strong_as_it_is_said_to_be(context: Context) -> None:
    case, baseline = context.case, context.baseline
    start = baseline.hypothesis.with_effect(effect("inhomogeneity:cylinder"), REGION)
    found = candidate_of(context, refit(case, start, baseline, evaluations=8))
    finer, followed = resolved(context, found)
    assert len(finer.problem.body.mesh.cells) > 2 * len(case.problem.body.mesh.cells)
    assert max(map(abs, pulls(found).values())) > 4.0
    assert max(map(abs, pulls(followed).values())) < 2.0
    assert max(followed.deviations[2:] / found.deviations[2:]) < 4.0


def test_both_meshes_leave_the_same_of_the_baseline(context: Context) -> None:
    case, baseline = context.case, context.baseline
    there = baseline.hypothesis.with_effect(effect("inhomogeneity:cylinder"), REGION)
    winner = candidate_of(context, linearise(case, there, baseline))
    finer, _ = resolved(context, winner)
    again = linearise(finer, baseline.hypothesis)
    np.testing.assert_allclose(again.residual[0], baseline.residual[0], atol=1e-3)


def test_what_does_not_end_within_elements_stays_as_it_is(context: Context) -> None:
    case, baseline = context.case, context.baseline
    yielding = baseline.hypothesis.with_effect(effect("gripper_compliance:translation"), {"compliance": 1e-5})
    winner = candidate_of(context, linearise(case, yielding, baseline))
    assert resolved(context, winner) == (case, winner)
