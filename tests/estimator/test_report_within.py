"""What pictures show of an organ beyond its skin: cavities, regions, painted patches."""

from collections.abc import Iterator

import numpy as np
import pytest
from organ_cases import CYST, RATIO, TUMOUR, organ_meshed_anew

from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.discretisation.surface import boundary_faces, facets
from estimator.forward.meshing import mesh_experiment
from estimator.report.drawing.scene import around, from_above, gripped_surface, held_pieces
from estimator.report.drawing.view import View
from estimator.report.drawing.within import carried, contour, facing, shells_within

COARSE = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=20e-3, growth=3.0, layers=1)
EXTENT = np.array([[-200.0] * 3, [200.0] * 3])


@pytest.fixture(scope="module")
def pull(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Experiment]:
    with organ_meshed_anew(tmp_path_factory) as planned:
        yield planned


@pytest.fixture(scope="module")
def problem(pull: Experiment) -> RetractionProblem:
    return mesh_experiment(pull, COARSE)


def test_an_organ_has_its_cavities_and_regions_within(pull: Experiment) -> None:
    cavity, region = shells_within(pull.phantom)
    assert (cavity.kind, cavity.name) == ("cavity", "cavity")
    assert (region.kind, region.label) == ("region", f"tumour, {RATIO:g} times as stiff")
    for shell, centre in ((cavity, CYST), (region, TUMOUR)):
        assert shell.surface.vertices.mean(axis=0) == pytest.approx(centre, abs=1e-3)
        assert shell.surface.volume_m3 > 0


def test_the_tissue_carries_them(pull: Experiment, problem: RetractionProblem) -> None:
    mesh = problem.body.mesh
    # stretched along x by a tenth
    displacement = 0.1 * mesh.points * [1.0, 0.0, 0.0]
    for one in carried(shells_within(pull.phantom), mesh):
        rest = one.shell.surface.vertices
        assert one.points(displacement) == pytest.approx(rest * [1.1, 1.0, 1.0], abs=2e-4)


def test_the_outline_of_a_ball_from_above_is_its_equator(pull: Experiment) -> None:
    ball = shells_within(pull.phantom)[1].surface
    from_top = View(0.0, 90.0)
    seen = facing(ball.vertices, ball.triangles, from_top)
    rim = ball.vertices[contour(ball.triangles, seen)] - TUMOUR
    assert np.linalg.norm(rim[..., :2], axis=-1) == pytest.approx(0.012, abs=1.5e-3)
    assert len(around(ball.vertices[:, :2])) > 8


def test_a_painted_patch_is_drawn_where_it_is_painted(pull: Experiment, problem: RetractionProblem) -> None:
    points = problem.body.mesh.points
    pieces = facets(boundary_faces(problem.body.mesh))
    middles = points[pieces].mean(axis=1)
    for box, nodes, rim in (
        (pull.anchors[0], problem.fixed, -0.055),
        (pull.grasp.box, problem.gripped, 0.058),
    ):
        drawn, held = held_pieces(box, points, pieces), nodes[pieces].all(axis=1)
        assert drawn.any()
        # but for triangles of the painting that its rim goes through
        assert middles[drawn != held, 0] == pytest.approx(rim, abs=0.009)
    in_cavity = np.linalg.norm(middles - CYST, axis=1) < 0.0102
    assert in_cavity.any()
    assert not held_pieces(pull.anchors[0], points, pieces)[in_cavity].any()
    assert gripped_surface(pull, EXTENT, 1).shape == (0, 4, 3)


def test_from_above_a_patch_is_no_box(pull: Experiment) -> None:
    outline = from_above(pull.grasp.box, EXTENT)
    assert len(outline) > 4
    x, y = outline.T
    area = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
    assert 0.4 < area / np.prod(np.ptp(outline, axis=0)) < 0.95
