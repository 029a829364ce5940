"""What finer meshes change is known at the fitted baseline, and anew where a cause has led far from it."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, follow, from_rest, recorded, straight_pull

from estimator.diagnosis.case import linearisation_of, linearise
from estimator.diagnosis.hypothesis import Hypothesis
from estimator.diagnosis.passage import mechanics_of, solve_case
from estimator.diagnosis.preparation import corrected_at, prepare
from estimator.diagnosis.result import AT_MOST
from estimator.diagnosis.sharpening import in_another_case
from estimator.effects.catalogue import CATALOGUE
from estimator.experiment import Experiment
from estimator.fem.observation import observe
from estimator.forward.meshing import mesh_experiment

TRUE_RATIO, FARTHER = 0.42, 0.475


def pulled(poisson_ratio: float) -> Experiment:
    problem = mesh_experiment(SMALL_BLOCK)
    poses = from_rest(SMALL_BLOCK, straight_pull(SMALL_BLOCK, 0.01, 4))
    states = follow(problem, Hypothesis(20e3, poisson_ratio).material(), poses)
    return recorded(SMALL_BLOCK, poses, [observe(problem, one) for one in states], np.random.default_rng(5))


def size_of_beads(correction: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(correction[:, 6:] ** 2)))


def test_far_from_the_baseline_the_discretisation_error_is_that_of_the_cause() -> None:
    with ThreadPoolExecutor(2) as executor:
        preparation, _ = prepare([pulled(TRUE_RATIO)], executor)
        here = preparation.corrected_at
        near = replace(here, poisson_ratio=here.poisson_ratio + 0.005)
        assert corrected_at(preparation, near, executor) is preparation
        there, _ = prepare([pulled(FARTHER)], executor)
        far = corrected_at(preparation, there.corrected_at, executor)
    found, before, expected = (one.case.corrections[0] for one in (far, preparation, there))
    assert size_of_beads(expected) > 1.2 * size_of_beads(before)
    assert size_of_beads(found - expected) < 0.02 * size_of_beads(expected - before)


def test_an_anchor_that_hardly_gives_leaves_the_discretisation_error_of_one_that_does_not() -> None:
    springs = next(one for one in CATALOGUE if one.name == "anchor_compliance:isotropic")
    with ThreadPoolExecutor(2) as executor:
        preparation, _ = prepare([pulled(TRUE_RATIO)], executor)
        rigid = replace(preparation.corrected_at, poisson_ratio=FARTHER)
        giving = rigid.with_effect(springs, {"length": 1e-5})
        expected, found = (
            corrected_at(preparation, one, executor).case.corrections[0] for one in (rigid, giving)
        )
    before = preparation.case.corrections[0]
    assert size_of_beads(found - expected) < 0.1 * size_of_beads(expected - before)


def test_a_fit_goes_over_to_other_corrections_as_if_it_had_been_made_with_them() -> None:
    with ThreadPoolExecutor(2) as executor:
        preparation, _ = prepare([pulled(TRUE_RATIO)], executor)
        hypothesis = replace(preparation.corrected_at, poisson_ratio=FARTHER)
        far = corrected_at(preparation, hypothesis, executor)
    before, after = preparation.cases(AT_MOST), far.cases(AT_MOST)
    moved = in_another_case(linearise(before, hypothesis), before, after)
    passages = solve_case(after.problem, after.experiments, hypothesis, after.loads)
    anew = linearisation_of(after, hypothesis, [mechanics_of(one) for one in passages])
    np.testing.assert_allclose(moved.residual[0], anew.residual[0], atol=1e-6)
    np.testing.assert_allclose(moved.by_coordinate[0], anew.by_coordinate[0], rtol=1e-2, atol=1e-2)
