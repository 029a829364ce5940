"""When a mesh is said to be coarse where the tissue is thin."""

import numpy as np
import pytest

from estimator.fem.discretisation.block_mesh import structured_mesh
from estimator.fem.discretisation.mesh import Mesh
from estimator.forward.coarseness import thin_tissue_note
from estimator.studies.paper_tables.tetrahedra import tetrahedral_mesh


def lines(cells: tuple[int, int, int], thickness_m: float) -> list[np.ndarray]:
    size = (0.1, 0.08, thickness_m)
    return [np.linspace(0.0, length, count + 1) for length, count in zip(size, cells, strict=True)]


def turned(mesh: Mesh) -> Mesh:
    rotation, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    rotation *= np.sign(np.linalg.det(rotation))
    return Mesh(mesh.points @ rotation.T, mesh.cells, mesh.kind)


@pytest.mark.parametrize(("thickness_m", "told"), [(4e-3, "4.0 mm thick"), (2e-3, "2.0 mm thick")])
def test_long_elements_across_a_thin_sheet_are_told_with_both_lengths(thickness_m: float, told: str) -> None:
    mesh = tetrahedral_mesh(lines((10, 8, 1), thickness_m))
    note = thin_tissue_note(turned(mesh))
    assert note == thin_tissue_note(mesh)
    assert note.startswith("the mesh is coarse where the tissue is thin: below ")
    assert told in note
    assert f"up to {1e3 * np.hypot(0.01 * 2**0.5, thickness_m):.1f} mm long" in note


@pytest.mark.parametrize(
    ("cells", "thickness_m"),
    [((10, 8, 1), 0.01), ((10, 8, 2), 2e-3), ((10, 8, 4), 0.02), ((50, 40, 1), 4e-3)],
    ids=["as long as thick", "two across", "a thick body", "fine"],
)
def test_nothing_is_said_of_other_meshes(cells: tuple[int, int, int], thickness_m: float) -> None:
    assert thin_tissue_note(turned(tetrahedral_mesh(lines(cells, thickness_m)))) == ""


def test_hexahedra_may_be_long() -> None:
    assert thin_tissue_note(structured_mesh(lines((4, 4, 1), 1e-3), "hex27")) == ""


def test_a_sheet_that_is_thin_in_places_is_told_with_these() -> None:
    x, y, z = lines((20, 8, 1), 0.02)
    mesh = tetrahedral_mesh([x, y, z])
    points = mesh.points.copy()
    points[:, 2] *= np.where((points[:, 0] > 0.03) & (points[:, 0] < 0.07), 0.1, 1.0)
    note = thin_tissue_note(Mesh(points, mesh.cells, mesh.kind))
    share = int(note.split("below ")[1].split(" %")[0])
    assert 15 < share < 45
    assert "2.0 mm thick" in note
