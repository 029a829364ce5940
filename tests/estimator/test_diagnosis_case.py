"""A whole diagnosis of a small phantom whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, recorded, straight_pull, turning_pull
from scipy.spatial.transform import Rotation

from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.result import Diagnosis
from estimator.diagnosis.what_if import what_if
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import observe
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
TRUTH = Material(NeoHookean(), 20e3, 0.44)
MOUNTING = Rotation.from_rotvec([0.0, 0.09, -0.05])


def turned_sensor() -> list[Experiment]:
    """Two retractions whose sensor sits askew by six degrees, on a finer mesh than the diagnosis."""
    rng = np.random.default_rng(7)
    problem = mesh_experiment(SMALL_BLOCK)
    solver = EquilibriumSolver(problem)
    found = []
    paths = (
        straight_pull(SMALL_BLOCK, 0.012, 4),
        turning_pull(SMALL_BLOCK, 0.01, np.radians([30.0, 0, 20.0]), 4),
    )
    for order, path in enumerate(paths, start=1):
        poses = [GripperPose(np.array(SMALL_BLOCK.grasp.centre), Rotation.identity()), *path]
        states = [solver.rest(TRUTH)]
        for pose in path:
            states.append(solver.solve(pose, TRUTH, states[-1]))
        experiment = recorded(SMALL_BLOCK, poses, [observe(problem, state) for state in states], rng)
        turned = [
            np.concatenate([(r * MOUNTING.inv() * r.inv()).apply(part) for part in wrench.reshape(2, 3)])
            for r, wrench in zip(
                Rotation.from_quat(experiment.quaternion_wxyz, scalar_first=True),
                experiment.wrench,
                strict=True,
            )
        ]
        found.append(replace(experiment, order=order, name=f"retraction {order}", wrench=np.array(turned)))
    return found


@pytest.fixture(scope="module")
def experiments() -> list[Experiment]:
    return turned_sensor()


@pytest.fixture(scope="module")
def diagnosis(experiments: list[Experiment]) -> Diagnosis:
    return diagnose(experiments)


def test_the_cause_is_named(diagnosis: Diagnosis) -> None:
    assert diagnosis.verdict == ("force_frame_rotation",)
    assert diagnosis.probabilities["force_frame_rotation"] > 0.9


def test_its_size_lies_within_its_error(diagnosis: Diagnosis) -> None:
    found = diagnosis.effects["force_frame_rotation"].parameters
    for axis, angle in zip("xyz", MOUNTING.as_rotvec(), strict=True):
        turn = found[f"rotation_{axis}"]
        assert abs(turn.value - angle) < 4 * turn.std


def test_the_material_comes_back(diagnosis: Diagnosis) -> None:
    after = diagnosis.after
    assert after.youngs_modulus.value == pytest.approx(TRUTH.youngs_modulus, rel=0.03)
    assert after.poisson_ratio.value == pytest.approx(TRUTH.poisson_ratio, abs=0.01)


def test_the_gap_closes_on_what_was_left_out(diagnosis: Diagnosis) -> None:
    gap = diagnosis.gap
    assert gap.after < gap.before
    # What is left is noise, whose own scatter is a third of this gap.
    assert 0.6 < gap.closure_held_out < 1.4
    assert diagnosis.where.blocks["force"] > 0.9


def test_its_signature_foretells_what_it_does_to_the_gap(diagnosis: Diagnosis) -> None:
    considered = diagnosis.considered["force_frame_rotation"]
    assert considered.achieved is not None
    # A turn of six degrees is nearly linear.
    foretold, achieved = considered.expected, considered.achieved
    assert foretold.gap.closure_held_out == pytest.approx(achieved.gap.closure_held_out, abs=0.1)
    # The diagnosis says of E what its leading cause does, and is as much less sure as others are probable.
    alone, said = achieved.material.youngs_modulus, diagnosis.after.youngs_modulus
    assert said.value == alone.value
    assert alone.std < said.std < 1.5 * alone.std
    for trace, expected, fitted in zip(diagnosis.traces, foretold.channels, achieved.channels, strict=True):
        signature, change = ((one - trace.before) / trace.deviation for one in (expected, fitted))
        assert np.corrcoef(signature.ravel(), change.ravel())[0, 1] > 0.95


def test_a_cause_tried_on_its_own_does_what_it_did_in_the_diagnosis(
    experiments: list[Experiment], diagnosis: Diagnosis
) -> None:
    tried = what_if(experiments, "force_frame_rotation", diagnosis.gap.floor, diagnosis.errors_left)
    known = diagnosis.considered["force_frame_rotation"]
    assert tried.achieved is not None and known.achieved is not None
    assert tried.achieved.gap.before == pytest.approx(known.achieved.gap.before, rel=1e-3)
    assert tried.achieved.gap.after == pytest.approx(known.achieved.gap.after, rel=1e-3)


def test_every_effect_is_considered(diagnosis: Diagnosis) -> None:
    assert diagnosis.considered.keys() == diagnosis.effects.keys()
    harmless = diagnosis.considered["tool_weight"].expected
    assert harmless.gap.closure_held_out < 0.5
