"""MuJoCo gets our mesh as a flex; what it answers is St. Venant's and Kirchhoff's law on linear tetrahedra."""

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from handover_cases import a_pull, handed_to

from estimator.fem.boundary.problem import HeldNodes, retraction_problem
from estimator.fem.discretisation.block_mesh import Grading, structured_mesh
from estimator.fem.discretisation.mesh import Mesh
from estimator.forward.model import ForwardModel
from estimator.handover.mujoco.engine import MuJoCo
from estimator.handover.mujoco.mjcf import mjcf_of
from estimator.handover.mujoco.tetrahedra import linear_tetrahedra
from estimator.materials import law_named
from estimator.materials.material import make_material

needs_mujoco = pytest.mark.skipif(
    importlib.util.find_spec("mujoco") is None, reason="MuJoCo is not installed: pip install mujoco"
)


# Both solve the same tetrahedra: their number costs time and tells nothing.
COARSER = Grading(grasp_m=10e-3, anchor_m=20e-3, largest_m=30e-3, growth=3.0, layers=1)


def volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    corners = points[tetrahedra]
    return np.asarray(np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6)


def test_tetrahedra_fill_the_body_and_meet_on_their_faces() -> None:
    lines = [np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, 2.5]), np.array([0.0, 1.0])]
    mesh = structured_mesh(lines, "hex27")
    tetrahedra = linear_tetrahedra(mesh)
    assert (volumes(mesh.points, tetrahedra) > 0).all()
    assert volumes(mesh.points, tetrahedra).sum() == pytest.approx(3 * 2.5 * 1)
    faces = np.sort(tetrahedra[:, [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]].reshape(-1, 3), axis=1)
    _, sharing = np.unique(faces, axis=0, return_counts=True)
    # Outside lie two triangles for each of the four squares of every outer face of the eight hexahedra.
    assert sharing.max() == 2
    assert (sharing == 1).sum() == 2 * 4 * 2 * (2 * 2 + 2 * 1 + 2 * 1)


def test_a_quadratic_tetrahedron_becomes_eight() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    edges = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    points = np.vstack([corners, [(corners[a] + corners[b]) / 2 for a, b in edges]])
    tetrahedra = linear_tetrahedra(Mesh(points, np.arange(10)[None], "tet10"))
    assert len(tetrahedra) == 8
    np.testing.assert_allclose(volumes(points, tetrahedra), 1 / 48)


def test_the_model_holds_our_phantom() -> None:
    handed = handed_to(MuJoCo())
    problem, root = handed.problem, ET.fromstring(mjcf_of(handed))
    flex = root.find("deformable/flex")
    elasticity = root.find("deformable/flex/elasticity")
    assert flex is not None
    assert elasticity is not None
    bodies = flex.attrib["body"].split()
    assert np.array_equal(np.array([body == "world" for body in bodies]), problem.fixed)
    assert np.array_equal(np.array([body == "gripper" for body in bodies]), problem.gripped)
    places = {
        body.attrib["name"]: np.array(body.attrib["pos"].split(), dtype=float)
        for body in root.findall("worldbody/body")
    }
    places["world"] = np.zeros(3)
    local = np.array(flex.attrib["vertex"].split(), dtype=float).reshape(-1, 3)
    points = np.array([places[body] for body in bodies]) + local
    np.testing.assert_allclose(points, problem.body.mesh.points, atol=1e-9)
    assert float(elasticity.attrib["young"]) == pytest.approx(15e3)
    assert float(elasticity.attrib["poisson"]) == pytest.approx(0.45)
    masses = [
        float(one.attrib["mass"])
        for body in root.findall("worldbody/body")
        if body.attrib["name"].startswith("v")
        for one in body.findall("inertial")
    ]
    assert 0.5 < sum(masses) / (1070 * problem.body.volume.sum()) < 1.0


@pytest.mark.parametrize(
    "effect", ["inhomogeneity=0.7,centre_x=0,centre_y=0", "anchor_compliance", "gravity_sag"]
)
def test_what_mujoco_cannot_express_is_left_out_by_name(effect: str) -> None:
    handed = handed_to(MuJoCo(), effect)
    assert handed.causes == ()
    assert len(handed.left_out) == 1


@needs_mujoco
@pytest.mark.parametrize("turn_rad", [0.0, 0.4])
def test_mujoco_answers_what_its_model_says(turn_rad: float, tmp_path: Path) -> None:
    """Beside our own solver with the same law on the same tetrahedra: forces, torques and beads."""
    planned = a_pull(0.004, 2, turn_rad)
    handed = handed_to(MuJoCo(), experiments=[planned], grading=COARSER)
    engine, problem = MuJoCo(), handed.problem
    engine.write(handed, tmp_path)
    (answer,) = engine.run(handed, tmp_path, lambda stage, done, total: None)
    mesh = problem.body.mesh
    linear = retraction_problem(
        Mesh(mesh.points, linear_tetrahedra(mesh), "tet4"),
        HeldNodes(problem.fixed, problem.gripped),
        problem.grasp_centre,
        problem.fiducials_rest,
        problem.fiducials_gripped,
    )
    law = law_named("st_venant_kirchhoff")
    ours = ForwardModel(linear, [planned]).predict(make_material(law, 15e3, 0.45), [range(2)])[0][1]
    np.testing.assert_allclose(
        answer.wrench[-1, :3], ours.wrench[:3], atol=2e-3 * np.linalg.norm(ours.wrench[:3])
    )
    lever = 0.01 * np.linalg.norm(ours.wrench[:3])
    np.testing.assert_allclose(answer.wrench[-1, 3:], ours.wrench[3:], atol=5e-3 * lever)
