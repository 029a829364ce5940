"""How the solver gets there: large steps, near-incompressible tissue, motions that have no equilibrium."""

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import (
    COARSE_GRADING,
    REFERENCE_BLOCK,
    REFERENCE_PATHS,
    follow,
    straight_pull,
    turning_pull,
)

from estimator.errors import InputError, SolverError
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import HeldNodes, RetractionProblem, retraction_problem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.forward.meshing import mesh_experiment
from estimator.materials import Gent, NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

SMALL = mesh_experiment(
    REFERENCE_BLOCK, Grading(grasp_m=8e-3, anchor_m=15e-3, largest_m=30e-3, growth=2.0, layers=1)
)
MATERIAL = Material(NeoHookean(), 15e3, 0.49)


def in_one_call(pose: GripperPose, material: Material = MATERIAL) -> EquilibriumState:
    solver = EquilibriumSolver(SMALL)
    return solver.solve(pose, material, solver.rest(material))


def free_residual(problem: RetractionProblem, state: EquilibriumState) -> float:
    """Forces on the free nodes, relative to those on the gripped ones."""
    forces = state.forces.reshape(-1)
    return float(
        np.linalg.norm(forces[problem.pattern.free]) / np.linalg.norm(forces[problem.pattern.gripped])
    )


def test_a_twist_of_45_degrees_with_60_percent_elongation_is_reached_from_rest_in_one_call() -> None:
    """The free length between anchor and grasp is 80 mm."""
    target = turning_pull(REFERENCE_BLOCK, 0.6 * 0.08, np.radians([45.0, 0.0, 0.0]), 12)
    state = in_one_call(target[-1])
    assert free_residual(SMALL, state) < 1e-8
    assert state.tangent.positive_definite
    in_steps = follow(SMALL, MATERIAL, target)[-1]
    np.testing.assert_allclose(state.displacement, in_steps.displacement, atol=1e-8)


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.3, 0.49, 0.4999])
def test_the_reference_paths_take_few_iterations_a_step_for_any_poisson_ratio(poisson_ratio: float) -> None:
    material = Material(NeoHookean(), 15e3, poisson_ratio)
    for path in REFERENCE_PATHS.values():
        states = follow(SMALL, material, path)
        assert max(state.iterations for state in states) <= 10
        assert max(free_residual(SMALL, state) for state in states) < 1e-8


def test_the_way_back_leads_through_the_same_states() -> None:
    out = straight_pull(REFERENCE_BLOCK, 0.02, 4)
    states = follow(SMALL, MATERIAL, [*out, *reversed(out[:-1])])
    for forth, back in zip(states[:3], reversed(states[4:]), strict=True):
        np.testing.assert_allclose(back.displacement, forth.displacement, atol=1e-9)
    assert states[4].iterations == 0, "the cubic through the last step ends where that step began"


def test_a_motion_through_the_anchor_ends_with_one_line_that_says_how_far_it_came() -> None:
    with pytest.raises(SolverError) as raised:
        in_one_call(straight_pull(REFERENCE_BLOCK, -0.2, 1)[0])
    message = str(raised.value)
    assert "\n" not in message
    assert message.startswith("no equilibrium beyond ")
    assert "% of the motion to [-160.0, 0.0, 0.0] mm" in message


def test_a_law_that_cannot_follow_ends_with_the_law_s_own_reason() -> None:
    with pytest.raises(SolverError, match=r"no equilibrium beyond \d+ %.*limit of the Gent law"):
        in_one_call(straight_pull(REFERENCE_BLOCK, 0.1, 1)[0], Material(Gent(), 15e3, 0.4, np.array([1.5])))


def test_a_guess_too_far_from_equilibrium_is_refused_and_not_followed() -> None:
    solver = EquilibriumSolver(SMALL)
    pose = straight_pull(REFERENCE_BLOCK, 0.2, 1)[0]
    nothing = np.zeros_like(SMALL.body.mesh.points)
    with pytest.raises(SolverError):
        solver.refine(pose, MATERIAL, nothing, np.zeros(SMALL.body.volume.shape))


def test_a_state_is_found_again_from_its_own_field() -> None:
    state = in_one_call(straight_pull(REFERENCE_BLOCK, 0.02, 1)[0])
    again = EquilibriumSolver(SMALL).refine(state.pose, MATERIAL, state.displacement, state.response.pressure)
    assert again.iterations == 0
    np.testing.assert_array_equal(again.displacement, state.displacement)


def test_the_tissue_at_rest_bears_no_force() -> None:
    rest = EquilibriumSolver(SMALL).rest(MATERIAL)
    assert rest.response.energy == pytest.approx(0.0, abs=1e-20)
    np.testing.assert_allclose(rest.forces, 0.0, atol=1e-14)


def test_states_keep_their_own_factors_when_the_solver_goes_on() -> None:
    """The solver overwrites factors that nobody holds; it must not touch one that somebody does."""
    problem = mesh_experiment(REFERENCE_BLOCK, COARSE_GRADING)
    solver = EquilibriumSolver(problem)
    load = np.random.default_rng(1).normal(size=len(problem.pattern.free))
    state = solver.rest(MATERIAL)
    kept, answers = [], []
    for pose in straight_pull(REFERENCE_BLOCK, 0.02, 3):
        state = solver.solve(pose, MATERIAL, state)
        kept.append(state)
        answers.append(state.tangent.free.solve(load))
    for held, answer in zip(kept, answers, strict=True):
        np.testing.assert_array_equal(held.tangent.free.solve(load), answer)
    assert not np.allclose(answers[0], answers[2])


def test_states_keep_their_own_factors_when_another_solver_of_the_same_problem_follows() -> None:
    loads = np.ones(len(SMALL.pattern.free))
    kept = EquilibriumSolver(SMALL).rest(MATERIAL)
    before = kept.tangent.free.solve(loads)
    softer = EquilibriumSolver(SMALL).rest(Material(NeoHookean(), 5e3, 0.49))
    np.testing.assert_array_equal(kept.tangent.free.solve(loads), before)
    np.testing.assert_allclose(softer.tangent.free.solve(loads), 3.0 * before, rtol=1e-9)


def test_a_problem_without_grasp_or_anchor_is_refused() -> None:
    mesh = SMALL.body.mesh
    none = np.zeros(len(mesh.points), dtype=bool)
    fiducials = np.zeros((0, 3)), np.zeros(0, dtype=bool)
    with pytest.raises(InputError, match=r"grasp box holds no tissue"):
        retraction_problem(mesh, HeldNodes(SMALL.fixed, none), SMALL.grasp_centre, *fiducials)
    with pytest.raises(InputError, match=r"no anchor box holds tissue"):
        retraction_problem(mesh, HeldNodes(none, SMALL.gripped), SMALL.grasp_centre, *fiducials)


def test_a_fiducial_off_the_tissue_is_named() -> None:
    outside = np.array([[0.0, 0.0, 0.005], [0.0, 0.0, 0.02]])
    with pytest.raises(InputError, match=r"fiducial 1 at \[0\.0, 0\.0, 20\.0\] mm lies 15\.00 mm outside"):
        retraction_problem(
            SMALL.body.mesh,
            HeldNodes(SMALL.fixed, SMALL.gripped),
            SMALL.grasp_centre,
            outside,
            np.zeros(2, dtype=bool),
        )
