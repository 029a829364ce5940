"""Hypotheses about an organ with a stiffer region, held where it is painted: what effects make of it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from organ_cases import RATIO, TUMOUR, organ_meshed_anew

from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import Mechanics, mechanics_of, solve_case
from estimator.diagnosis.sensitivity.perturbation import Perturbation
from estimator.diagnosis.sensitivity.readings import channels, derivatives, predicted_readings
from estimator.diagnosis.settings import DiagnosisSettings, SolverSettings
from estimator.effects.catalogue import CATALOGUE
from estimator.effects.effect import Effect
from estimator.experiment import Box, Experiment, Grasp
from estimator.fem.assembly.body import Body, build_body
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.discretisation.quadrature import quadrature_points
from estimator.fem.equilibrium.morph import beads_from_grasp, with_beads_at
from estimator.fem.terms.steady import NodalSprings
from estimator.forward.meshing import mesh_experiment

FloatArray = NDArray[np.float64]

COARSE = Grading(grasp_m=4e-3, anchor_m=8e-3, largest_m=16e-3, growth=3.0, layers=1)
BASE = Hypothesis(8e3, 0.42)
ZERO = np.zeros((2, 6 + 3 * 8))
DEVIATION = np.concatenate([[0.02] * 3, [5e-4] * 3, [5e-5] * 24])


@pytest.fixture(scope="module")
def pull(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Experiment]:
    with organ_meshed_anew(tmp_path_factory) as planned:
        yield planned


@pytest.fixture(scope="module")
def problem(pull: Experiment) -> RetractionProblem:
    return mesh_experiment(pull, COARSE)


def named(name: str) -> Effect:
    return next(one for one in CATALOGUE if one.name == name)


def with_one(name: str, **values: float) -> Hypothesis:
    effect = named(name)
    constants = {one.name: one.grid[0] if one.grid else one.lower for one in effect.constants}
    return BASE.with_effect(effect, {**constants, **{a.name: 0.0 for a in effect.amplitudes}, **values})


def middle_of_what_is_stiffer(body: Body) -> FloatArray:
    weight = np.log(body.modulus) * body.rest_volume
    return np.asarray(np.einsum("eq,eqx->x", weight, quadrature_points(body.mesh)) / weight.sum())


def stiffer_volume(body: Body) -> float:
    return float((np.log(body.modulus) * body.rest_volume).sum() / np.log(RATIO))


@pytest.mark.parametrize(
    "shift", [{"shift_x": 0.006}, {"shift_y": -0.006}, {"shift_x": 0.004, "shift_y": 0.004}]
)
def test_a_region_stays_where_it_is_when_the_jaws_hold_other_tissue(
    problem: RetractionProblem, shift: dict[str, float]
) -> None:
    moved = with_one("grasp_misplacement:jaws", **shift).problem(problem)
    nodes = moved.body.mesh.points - problem.body.mesh.points
    near = np.linalg.norm(problem.body.mesh.points - TUMOUR, axis=1) < 0.012
    # the elements are carried through the region
    assert np.linalg.norm(nodes[near], axis=1).mean() > 1e-3
    carried = middle_of_what_is_stiffer(problem.body)
    assert carried == pytest.approx(TUMOUR, abs=1e-3)
    assert middle_of_what_is_stiffer(moved.body) == pytest.approx(carried, abs=4e-4)
    assert stiffer_volume(moved.body) == pytest.approx(stiffer_volume(problem.body), rel=0.05)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("thickness_error:about_middle", {"excess": 0.1}),
        ("prestretch:along", {"along": 0.003}),
        ("grasp_misplacement:origin", {"shift_x": 0.003}),
        ("anchor_debonding:throughout", {"share": 0.3}),
        ("anchor_compliance:isotropic", {"length": 0.004}),
    ],
)
def test_a_region_is_as_stiff_beside_an_effect(
    problem: RetractionProblem, name: str, values: dict[str, float]
) -> None:
    with_effect = with_one(name, **values).problem(problem).body
    assert np.array_equal(with_effect.modulus, problem.body.modulus)
    assert 0.5 * (1.0 + RATIO) < with_effect.modulus.max() < RATIO * (1.0 + 1e-9)


def test_what_else_is_stiffer_multiplies(problem: RetractionProblem) -> None:
    lump = with_one(
        "inhomogeneity:sphere", log_stiffness_ratio=0.7, centre_x=0.01, centre_y=0.0, radius=0.015
    )
    of_both = lump.problem(problem).body.modulus
    plain = replace(problem, body=build_body(problem.body.mesh), regions=())
    alone = lump.problem(plain).body.modulus
    assert of_both == pytest.approx(alone * problem.body.modulus)


def solved(pull: Experiment, problem: RetractionProblem, hypothesis: Hypothesis) -> list[Mechanics]:
    exact = DiagnosisSettings(solver=SolverSettings(tangent_reuse=0.0))
    setup = Setup([pull], problem, [GripLoad.none(2)], settings=exact)
    return [mechanics_of(one) for one in solve_case(setup, hypothesis)]


def read(mechanics: list[Mechanics], hypothesis: Hypothesis) -> FloatArray:
    """The wrench; a bead beside the edge of an element follows another one once the mesh is moved."""
    return (channels(predicted_readings(mechanics[0], hypothesis, ZERO)) / DEVIATION)[:, :6]


@pytest.mark.parametrize(
    "name", ["grasp_misplacement:jaws", "grasp_misplacement:turned", "inhomogeneity:sphere"]
)
def test_derivatives_are_those_of_the_organ_with_its_region(
    pull: Experiment, problem: RetractionProblem, name: str
) -> None:
    effect, null = named(name), with_one(name)
    amplitude = next(one for one in free_parameters(null) if one.effect == 0)
    step = Perturbation(amplitude.name, amplitude.put(null, amplitude.step), effect, amplitude.step)
    baseline = solved(pull, problem, BASE)
    predicted = derivatives(baseline, null, [step], [ZERO])[0][:, :6, 0] / DEVIATION[:6]
    size = 0.02 * amplitude.prior_scale
    slopes = []
    for value in (size, size / 2):
        there = amplitude.put(null, value)
        slopes.append((read(solved(pull, problem, there), there) - read(baseline, BASE)) / value)
    resolved = 2 * slopes[1] - slopes[0]
    assert np.linalg.norm(predicted - resolved) < 0.03 * np.linalg.norm(resolved)


def test_beads_on_a_painted_patch_are_gripped_and_those_below_and_beside_it_are_not(
    pull: Experiment, problem: RetractionProblem
) -> None:
    on = problem.body.mesh.points[problem.gripped]
    below = on.mean(axis=0)
    lower, upper = np.array(pull.grasp.box.lower), np.array(pull.grasp.box.upper)
    assert ((below > lower) & (below < upper)).all()
    beads = np.array([on[np.argmax(on[:, 0])], below, pull.fiducials_rest[0]])
    with_others = mesh_experiment(replace(pull, fiducials_rest=beads), COARSE)
    assert with_others.fiducials_gripped.tolist() == [True, False, False]
    again = with_beads_at(with_others, beads)
    assert again.fiducials_gripped.tolist() == [True, False, False]
    away = beads_from_grasp(again)
    assert away[0] == 0.0
    assert away[1] > 2e-3
    assert away[2] > 0.05


def test_a_painted_patch_is_as_far_as_its_nearest_corner(pull: Experiment) -> None:
    patch = pull.grasp.box
    middle = (np.array(patch.lower) + patch.upper) / 2
    # within the bounding box, and in the midst of the tissue
    assert patch.distance(middle) > 3e-3
    assert patch.distance(np.array([[0.08, 0.0, 0.0], [-0.05, 0.0, 0.0]])) == pytest.approx(
        [0.0, 0.11], abs=0.015
    )


def test_a_bead_on_the_tip_that_a_box_grips_stays_in_the_grip_when_the_jaws_lie_elsewhere(
    pull: Experiment,
) -> None:
    tip = Box((0.058, -0.03, -0.03), (0.09, 0.03, 0.03))
    beads = np.array([[0.0785, 0.0, -0.006], pull.fiducials_rest[0]])
    boxed = replace(pull, grasp=Grasp(tip, pull.grasp.centre), fiducials_rest=beads)
    with_tip = mesh_experiment(boxed, COARSE)
    assert with_tip.fiducials_gripped.tolist() == [True, False]
    for shift in ({"shift_x": 1e-5}, {"shift_x": 0.004}, {"shift_y": -0.003}):
        moved = with_one("grasp_misplacement:jaws", **shift).problem(with_tip)
        assert moved.fiducials_gripped.tolist() == [True, False]


@pytest.mark.parametrize("share", [0.15, 0.4])
def test_a_patch_that_has_come_off_in_part_is_held_by_finite_springs(
    pull: Experiment, problem: RetractionProblem, share: float
) -> None:
    off = with_one("anchor_debonding:throughout", share=share)
    changed = off.problem(problem)
    assert np.count_nonzero(changed.fixed) < np.count_nonzero(problem.fixed)
    for term in off.terms(changed, pull):
        assert isinstance(term, NodalSprings)
        assert np.isfinite(term.springs).all()
        assert (np.trace(term.springs, axis1=1, axis2=2) >= 0).all()
