"""The maker's own mechanics: against converged solutions, against energies, and apart from the estimator's."""

import ast
from pathlib import Path

import numpy as np
import pytest
from blind_scenes import BEADS, COARSE
from scipy.spatial.transform import Rotation

from estimator.blind import making
from estimator.blind.making.mechanics.energies import (
    Stretches,
    TransverselyIsotropic,
    both_ways,
    fading,
    hardening,
    power_of_invariant,
    recruited,
    root,
)
from estimator.blind.making.mechanics.equilibrium import Solver
from estimator.blind.making.mechanics.holding import Pose
from estimator.blind.making.mechanics.laws import (
    Fibres,
    Law,
    Term,
    exponential,
    limited,
    logarithmic,
    power,
    tension_only,
)
from estimator.blind.making.mechanics.response import Instant
from estimator.blind.making.scenes.retraction import GRIPPER_AT_REST
from estimator.blind.making.scenes.scene import Mechanics
from estimator.blind.making.scenes.simulate import Resolution, held_body

LAWS = {
    "baseline": Law(1e4, 0.4),
    "yeoh": Law(1e4, 0.4, (Term("isochoric_1", power(2), 0.3), Term("isochoric_1", power(3), 0.1))),
    "gent": Law(1e4, 0.4, (Term("coupled_1", limited(5.0)),)),
    "exponential": Law(1e4, 0.4, (Term("isochoric_1", exponential(0.8)),)),
    "mooney_rivlin": Law(1e4, 0.4, (Term("isochoric_2", power(1), 0.3), Term("isochoric_1", power(1), -0.3))),
    "gent_thomas": Law(1e4, 0.4, (Term("isochoric_2", logarithmic(), 0.5),)),
    "fibres": Law(1e4, 0.4, fibres=(Fibres((0.6, 0.8, 0.0), power(2), 0.5),)),
    "ogden": Law(1e4, 0.4, additions=(Stretches((6.0, -5.0), (0.4, 0.3)),)),
    "lopez_pamies": Law(1e4, 0.4, (Term("isochoric_1", power_of_invariant(2.5)),)),
    "knowles": Law(1e4, 0.4, (Term("coupled_1", hardening(1.2, 2.5)),)),
    "toe": Law(1e4, 0.4, (Term("isochoric_1", recruited(0.05), 2.0),)),
    "carroll": Law(1e4, 0.4, (Term("isochoric_2", root(), 0.4), Term("isochoric_1", power(1), -0.4))),
    "alexander": Law(1e4, 0.4, (Term("isochoric_2", fading(0.7), 0.4), Term("isochoric_1", power(1), -0.4))),
    "exponential_fibres": Law(1e4, 0.4, fibres=(Fibres((1.0, 0.0, 0.0), both_ways(2.0), 0.5),)),
    "dispersed_fibres": Law(1e4, 0.4, fibres=(Fibres((0.6, 0.8, 0.0), tension_only(0.7), 0.5, 0.2),)),
    "transversely_isotropic": Law(
        1e4, 0.4, additions=(TransverselyIsotropic((0.6, 0.8, 0.0), 1.0, 0.2, 0.4),)
    ),
    "taut_fibres": Law(1e4, 0.4, fibres=(Fibres((1.0, 0.0, 0.0), tension_only(0.7), 0.5),)),
}


def some_deformations() -> np.ndarray:
    random = np.random.default_rng(0)
    F = np.eye(3) + 0.1 * random.standard_normal((6, 3, 3)) + np.diag([0.3, 0.0, 0.0])
    C = np.swapaxes(F, 1, 2) @ F
    return C[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_stress_and_tangent_are_derivatives_of_the_energy(law: Law) -> None:
    C = some_deformations()
    _, S, D = law.stress(C)
    step = 1e-6
    for k in range(6):
        change = np.zeros(6)
        change[k] = 2 * step if k < 3 else step
        more, less = law.stress(C + change), law.stress(C - change)
        np.testing.assert_allclose((more[0] - less[0]) / (2 * step), S[:, k], atol=1e-6 * abs(S).max())
        np.testing.assert_allclose((more[1] - less[1]) / (2 * step), D[:, :, k], atol=1e-6 * abs(D).max())


LIKE_THE_BASELINE = [
    "yeoh",
    "gent",
    "exponential",
    "mooney_rivlin",
    "ogden",
    "lopez_pamies",
    "knowles",
    "toe",
]


@pytest.mark.parametrize("name", [*LIKE_THE_BASELINE, "carroll", "alexander"])
def test_added_terms_leave_small_strain_as_it_was(name: str) -> None:
    rest = np.array([[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]])
    for with_terms, without in zip(LAWS[name].stress(rest), LAWS["baseline"].stress(rest), strict=True):
        np.testing.assert_allclose(with_terms, without, atol=1e-9 * 1e4)


@pytest.mark.parametrize(
    ("poisson_ratio", "force", "displacements_mm"),
    # At 20 mm: Fx, and how the beads at (-10, -10) and (10, -30) mm move: converged solutions of NGSolve.
    [
        (0.35, 2.3427, [[7.3566, 0.8936, -0.3103], [9.7202, 2.7600, -0.2305]]),
        (0.49, 2.2907, [[7.1605, 1.1272, -0.4279], [9.4683, 3.4488, -0.3141]]),
    ],
)
def test_the_pull_of_a_converged_solution_comes_out(
    poisson_ratio: float, force: float, displacements_mm: list[list[float]]
) -> None:
    held = held_body(Mechanics(Law(15e3, poisson_ratio)), Resolution(0.001, 0.003, 0.01, 0.01))
    solver = Solver(held)
    pose = Pose(GRIPPER_AT_REST + np.array([0.02, 0.0, 0.0]), Rotation.identity())
    state = solver.advance(solver.rest(), pose, Instant(0.0, 0.0, 1, 0.02))
    assert -state.wrench[0] == pytest.approx(force, rel=0.006)
    assert np.abs(state.wrench[1:]).max() < 1e-4
    mesh = held.body.mesh
    cells, shapes = mesh.locate(np.array([[-0.01, -0.01, 0.005], [0.01, -0.03, 0.005]]))
    moved = np.einsum("mn,mni->mi", shapes, state.u[mesh.cells[cells]])
    np.testing.assert_allclose(1e3 * moved, displacements_mm, atol=0.03)


def test_the_work_of_the_wrench_is_the_stored_energy() -> None:
    held = held_body(Mechanics(Law(15e3, 0.45)), COARSE)
    solver = Solver(held)
    state = solver.rest()
    angle, distance, steps = 0.5, 0.02, 24
    work, before = 0.0, np.zeros(6)
    for k in range(1, steps + 1):
        share = k / steps
        turn = Rotation.from_rotvec([0.0, 0.0, share * angle])
        pose = Pose(GRIPPER_AT_REST + np.array([share * distance, 0.0, 0.0]), turn)
        state = solver.advance(state, pose, Instant(0.0, 0.0, 1, 0.0))
        mean = (state.wrench + before) / 2
        work -= (mean[0] * distance + mean[5] * angle) / steps
        before = state.wrench
    strain = held.body.strain(state.u)
    energy, _, _ = held.material.law.stress(strain.C)
    assert work == pytest.approx(float(energy @ held.body.quadrature.volumes.reshape(-1)), rel=2e-3)


def test_beads_are_found_where_they_are() -> None:
    mesh = held_body(Mechanics(Law(15e3, 0.45), grasp_yaw=0.1), COARSE).body.mesh
    cells, shapes = mesh.locate(BEADS)
    np.testing.assert_allclose(
        np.einsum("mn,mni->mi", shapes, mesh.points[mesh.cells[cells]]), BEADS, atol=1e-9
    )


def test_the_mesh_has_the_volume_of_the_block_however_the_grasp_is_turned() -> None:
    mechanics = Mechanics(Law(15e3, 0.45), grasp_yaw=0.1, grasp_shift=(-0.004, 0.003))
    volumes = held_body(mechanics, COARSE).body.quadrature.volumes
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(1e-4, rel=1e-9)


def test_a_turned_grasp_is_as_wide_as_ever() -> None:
    yaw = 0.27
    straight, turned = (
        held_body(Mechanics(Law(15e3, 0.45), grasp_yaw=angle), COARSE) for angle in (0.0, yaw)
    )
    before, after = (held.body.mesh.points[held.gripped] - GRIPPER_AT_REST for held in (straight, turned))
    sides = np.isclose(np.abs(before[:, 1]), 0.01)
    across = after[sides] @ np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    np.testing.assert_allclose(across, before[sides, 1], atol=1e-12)
    inner = np.isclose(before[:, 0], -0.01)
    np.testing.assert_allclose(after[inner] @ [np.cos(yaw), np.sin(yaw), 0.0], -0.01, atol=1e-12)


def test_the_maker_shares_no_mechanics_with_the_estimator() -> None:
    # A phantom's surface is written by the code that reads it.
    shared = {"blind", "experiment", "errors", "workers", "surfaces"}
    for path in Path(making.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = []
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0
                names = [node.module or ""]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            own = [name.split(".")[1] for name in names if name.startswith("estimator.")]
            assert set(own) <= shared, path.name
