"""What befalls tissue and robot without having a label: shrinkage, air below, a joint that jams."""

from dataclasses import replace

import numpy as np
import pytest
from effect_cases import felt, there_and_back
from numpy.testing import assert_allclose
from retraction_cases import REFERENCE_BLOCK
from tissue_effects import (
    PROBLEM,
    TISSUE,
    driven,
    force_change,
    pulled_to,
    response_to,
    smooth_field,
    stiffness_of,
    times_change,
)

from estimator.effects.outside.air_pocket import AirPocket
from estimator.effects.outside.jammed_joint import JammedJoint
from estimator.effects.outside.shrinkage import Shrinkage
from estimator.fem.assembly.body import respond
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.terms.swelling import Swelling
from estimator.forward.meshing import mesh_experiment

AT_REST = GripperPose(np.array(REFERENCE_BLOCK.grasp.centre), there_and_back().rotation[0])
SECOND = replace(REFERENCE_BLOCK, order=2)
POCKET = {"pressure_over_modulus": 2e-3, "centre_x": -0.01, "centre_y": 0.01, "radius": 0.02, "height": 5e-4}


def volume_at(field: np.ndarray) -> float:
    return float(np.sum(np.linalg.det(response_to(field).F) * PROBLEM.body.volume))


def test_swelling_does_its_work_on_the_change_of_volume():
    term = Swelling(PROBLEM.body, 300.0)
    field, change, step = smooth_field(0.1), smooth_field(1.0, seed=3), 1e-5
    grown = (volume_at(field + step * change) - volume_at(field - step * change)) / (2 * step)
    assert float(np.sum(term.forces(field, response_to(field)) * change)) == pytest.approx(-300.0 * grown)


def test_the_stiffness_of_swelling_is_the_derivative_of_its_forces():
    term = Swelling(PROBLEM.body, 300.0)
    field, change = smooth_field(0.1), smooth_field(1.0, seed=3)
    expected = force_change(term, field, change, TISSUE)
    found = times_change(stiffness_of(term, field), change)
    assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_tissue_between_anchor_and_grasp_swells_by_its_strain_where_nothing_holds_it():
    strain = 2e-3
    terms = Shrinkage().terms(PROBLEM, TISSUE, SECOND, {"strain_per_experiment": strain})
    solver = EquilibriumSolver(PROBLEM)
    state = solver.solve(AT_REST, TISSUE, solver.rest(TISSUE), terms)
    points = PROBLEM.body.mesh.points
    grasp, anchored = points[PROBLEM.gripped], points[PROBLEM.anchored]
    far = 0.02
    free = (
        (np.abs(points[:, 2]) > 0.9 * np.abs(points[:, 2]).max())
        & (np.linalg.norm(points[:, None] - grasp, axis=2).min(axis=1) > far)
        & (np.linalg.norm(points[:, None] - anchored, axis=2).min(axis=1) > far)
    )
    thickening = (state.displacement[free, 2] / points[free, 2]).mean()
    # Held in the plane it would grow by (1 + ν) / (1 − ν) times as much through its thickness.
    assert strain < thickening < strain * (1 + TISSUE.poisson_ratio) / (1 - TISSUE.poisson_ratio)
    assert volume_at(state.displacement) > PROBLEM.body.volume.sum()


def test_nothing_has_shrunk_before_the_first_experiment():
    (term,) = Shrinkage().terms(PROBLEM, TISSUE, REFERENCE_BLOCK, {"strain_per_experiment": 0.01})
    field = smooth_field()
    assert not term.forces(field, response_to(field)).any()


def test_an_air_pocket_pushes_by_its_pressure_times_its_area_until_the_tissue_has_risen():
    problem = mesh_experiment(REFERENCE_BLOCK, Grading(2e-3, 4e-3, 4e-3, 2.0, 1))
    (term,) = AirPocket().terms(problem, TISSUE, REFERENCE_BLOCK, POCKET)
    still = np.zeros_like(problem.body.mesh.points)

    def push(risen_m: float) -> np.ndarray:
        field = still + np.array([0.0, 0.0, risen_m])
        return -term.forces(field, respond(problem.body, TISSUE, field)).sum(axis=0)

    assert push(0.0) == pytest.approx([0.0, 0.0, 2e-3 * 1e4 * np.pi * 0.02**2], rel=0.05)
    assert push(2.5e-4) == pytest.approx(0.5 * push(0.0))
    assert push(6e-4) == pytest.approx(0.0)


def test_the_stiffness_of_an_air_pocket_is_the_derivative_of_its_forces():
    (term,) = AirPocket().terms(PROBLEM, TISSUE, REFERENCE_BLOCK, POCKET)
    field, change = smooth_field(0.02), smooth_field(1.0, seed=3)
    expected = force_change(term, field, change, TISSUE)
    found = term.stiffness(field, response_to(field)).nodes
    assert_allclose(np.einsum("nij,nj->ni", found, change), expected, atol=1e-6 * np.abs(expected).max())


def test_an_air_pocket_lifts_the_tissue_above_it():
    terms = AirPocket().terms(PROBLEM, TISSUE, REFERENCE_BLOCK, POCKET)
    _, state, _ = driven(pulled_to(0.1), terms)
    _, without, _ = driven(pulled_to(0.1))
    points = PROBLEM.body.mesh.points
    above = np.linalg.norm(points[:, :2] - [-0.01, 0.01], axis=1) < 0.015
    assert (state.displacement - without.displacement)[above, 2].mean() > 0


def test_a_jammed_wrist_turns_no_farther_and_moves_all_the_way():
    motion = there_and_back(turn_rad=(0.0, 0.0, 0.4))
    held = JammedJoint("turn").motion(motion, {"lost": 1.0, "reach": 0.3})
    assert held.rotation.magnitude().max() == pytest.approx(0.3)
    near = motion.rotation.magnitude() < 0.3
    assert_allclose(held.rotation.as_rotvec()[near], motion.rotation.as_rotvec()[near])
    assert_allclose(held.position, motion.position)


def test_a_joint_that_drags_loses_a_share_of_the_travel_beyond_its_reach():
    motion = there_and_back()
    held = JammedJoint("travel").motion(motion, {"lost": 0.5, "reach": 0.012})
    moved = np.linalg.norm(held.position - np.array(REFERENCE_BLOCK.grasp.centre), axis=1)
    assert moved.max() == pytest.approx(0.016)
    assert moved[:10] == pytest.approx(0.001 * np.arange(10), abs=1e-12)


def test_a_search_for_a_jam_begins_within_the_motion_that_there_is():
    readings = [felt(there_and_back()), felt(there_and_back(turn_rad=(0.0, 0.0, 0.4)))]
    turns = [start["reach"] for start in JammedJoint("turn").starts(readings)]
    travels = [start["reach"] for start in JammedJoint("travel").starts(readings)]
    assert_allclose(turns, 0.4 * np.array([0.3, 0.5, 0.7, 0.85, 0.95]))
    assert_allclose(travels, 0.02 * np.array([0.3, 0.5, 0.7, 0.85, 0.95]))
