"""What finer meshes change is known at the fitted baseline, and anew where a cause has led far from it."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, follow, from_rest, recorded, straight_pull

from estimator.diagnosis.evidence.noise_selection import in_another_case
from estimator.diagnosis.fitting.case import Linearisation, linearise, predictions
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import mechanics_of, solve_case
from estimator.diagnosis.noise.errors_left import AT_MOST
from estimator.diagnosis.search.baseline import Preparation, corrected_at, prepare
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE
from estimator.experiment import Experiment
from estimator.fem.equilibrium.observation import observe
from estimator.fit.settings import FitSettings
from estimator.forward.gradings import FINE_GRADING
from estimator.forward.meshing import mesh_experiment

SETTINGS = DiagnosisSettings()

TRUE_RATIO, FARTHER = 0.42, 0.475
# Beads on either side of the rim of the grasp, which is at x = 18 mm.
RIM_BEADS = replace(
    SMALL_BLOCK, fiducials_rest=1e-3 * np.array([(x, y, 5.0) for x in (17.3, 18.3) for y in (-9.0, 0.0, 9.0)])
)


def pulled(poisson_ratio: float, rest: Experiment = SMALL_BLOCK) -> Experiment:
    problem = mesh_experiment(rest)
    poses = from_rest(rest, straight_pull(rest, 0.01, 4))
    states = follow(problem, Hypothesis(20e3, poisson_ratio).material(), poses)
    return recorded(rest, poses, [observe(problem, one) for one in states], np.random.default_rng(5))


def fitted(preparation: Preparation, hypothesis: Hypothesis) -> Linearisation:
    return linearise(preparation.cases(AT_MOST), hypothesis)


def size_of_beads(correction: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(correction[:, 6:] ** 2)))


def test_far_from_the_baseline_the_discretisation_error_is_that_of_the_cause() -> None:
    with ThreadPoolExecutor(2) as executor:
        preparation, _ = prepare([pulled(TRUE_RATIO)], SETTINGS, FitSettings(), executor)
        here = preparation.corrected_at
        near = replace(here, poisson_ratio=here.poisson_ratio + 0.005)
        assert corrected_at(preparation, fitted(preparation, near), executor) is preparation
        there, _ = prepare([pulled(FARTHER)], SETTINGS, FitSettings(), executor)
        far = corrected_at(preparation, fitted(preparation, there.corrected_at), executor)
    found, before, expected = (one.case.corrections[0] for one in (far, preparation, there))
    assert size_of_beads(expected) > 1.2 * size_of_beads(before)
    assert size_of_beads(found - expected) < 0.02 * size_of_beads(expected - before)


def test_an_anchor_that_hardly_gives_leaves_the_discretisation_error_of_one_that_does_not() -> None:
    springs = next(one for one in CATALOGUE if one.name == "anchor_compliance:isotropic")
    with ThreadPoolExecutor(2) as executor:
        preparation, _ = prepare([pulled(TRUE_RATIO)], SETTINGS, FitSettings(), executor)
        rigid = replace(preparation.corrected_at, poisson_ratio=FARTHER)
        giving = rigid.with_effect(springs, {"length": 1e-5})
        expected, found = (
            corrected_at(preparation, fitted(preparation, one), executor).case.corrections[0]
            for one in (rigid, giving)
        )
    before = preparation.case.corrections[0]
    assert size_of_beads(found - expected) < 0.1 * size_of_beads(expected - before)


def test_a_fit_goes_over_to_other_corrections_as_if_it_had_been_made_with_them() -> None:
    with ThreadPoolExecutor(2) as executor:
        preparation, _ = prepare([pulled(TRUE_RATIO)], SETTINGS, FitSettings(), executor)
        hypothesis = replace(preparation.corrected_at, poisson_ratio=FARTHER)
        far = corrected_at(preparation, fitted(preparation, hypothesis), executor)
    before, after = preparation.cases(AT_MOST), far.cases(AT_MOST)
    moved = in_another_case(linearise(before, hypothesis), before, after)
    anew = linearise(after, hypothesis)
    np.testing.assert_allclose(moved.residual[0], anew.residual[0], atol=1e-6)
    np.testing.assert_allclose(moved.jacobian[0], anew.jacobian[0], rtol=1e-2, atol=1e-2)


@pytest.mark.parametrize(
    ("form", "values"),
    [
        ("prestretch:beads_known_after", {"drawn_x": 8e-4, "drawn_y": 0.0}),
        ("grasp_misplacement:gripper", {"shift_x": 8e-4, "shift_y": 0.0}),
        ("grasp_misplacement:jaws", {"shift_x": -8e-4, "shift_y": 0.0}),
    ],
)
def test_a_bead_that_a_cause_puts_elsewhere_beside_the_rim_of_the_grasp_is_corrected_there(
    form: str, values: dict[str, float]
) -> None:
    effect = next(one for one in CATALOGUE if one.name == form)
    with ThreadPoolExecutor(2) as executor:
        preparation, _ = prepare([pulled(TRUE_RATIO, RIM_BEADS)], SETTINGS, FitSettings(), executor)
        hypothesis = preparation.corrected_at.with_effect(effect, values)
        fit = fitted(preparation, hypothesis)
        corrected = corrected_at(preparation, fit, executor)
    case = preparation.case
    fine = replace(
        case,
        problem=mesh_experiment(case.experiments[0], FINE_GRADING),
        corrections=(np.zeros_like(case.corrections[0]),),
    )
    solutions = solve_case(fine, hypothesis)
    (expected,) = predictions(fine, [mechanics_of(one) for one in solutions], hypothesis)
    left, missed = (
        size_of_beads(predictions(one.case, fit.mechanics, hypothesis)[0] - expected)
        for one in (corrected, preparation)
    )
    assert left < 0.1 * missed
