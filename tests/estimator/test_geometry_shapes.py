"""Generated phantoms: an organ and rough blocks are closed, seeded, and have the stated size."""

import numpy as np
import pytest

from estimator.geometry.organ import organ_surface
from estimator.geometry.rough import ridged_multifractal, rough_block
from estimator.geometry.shapes import block_surface, sphere_surface
from estimator.surfaces.queries import inside
from estimator.surfaces.surface import directed_edges

SIZE = (0.1, 0.1, 0.01)


def test_a_sphere_approaches_its_volume_at_second_order() -> None:
    exact = 4 / 3 * np.pi * 0.05**3
    errors = [1 - sphere_surface(0.05, n).volume_m3 / exact for n in (2, 3, 4)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


def test_a_block_has_its_volume_area_and_grid() -> None:
    block = block_surface(SIZE, (10, 8, 2))
    assert block.volume_m3 == pytest.approx(1e-4)
    assert block.areas.sum() == pytest.approx(0.024)
    assert len(block.triangles) == 2 * 2 * (10 * 8 + 8 * 2 + 10 * 2)


@pytest.mark.parametrize("seed", range(5))
def test_an_organ_is_smooth_and_does_not_cross_itself(seed: int) -> None:
    organ = organ_surface(seed, subdivisions=3)
    lower, upper = organ.bounds
    assert upper == pytest.approx(-lower)
    assert upper[0] - lower[0] == pytest.approx(0.2)
    assert 2e-4 < organ.volume_m3 < 9e-4
    normals = organ.area_vectors / organ.areas[:, None]
    edges = np.sort(directed_edges(organ.triangles), axis=1)
    first, second = np.lexsort(edges.T).reshape(-1, 2).T
    between = np.einsum("ex,ex->e", normals[first // 3], normals[second // 3])
    assert np.degrees(np.arccos(between.min())) < 60.0
    centres, step = organ.corners.mean(axis=1), 5e-4
    assert inside(organ, centres - step * normals).all()
    assert not inside(organ, centres + step * normals).any()


def test_an_organ_has_a_thick_and_a_thin_lobe() -> None:
    x, _, z = organ_surface(0).vertices.T
    thick, thin = (np.ptp(z[np.abs(x - place) < 0.01]) for place in (-0.05, 0.07))
    assert thick > 1.5 * thin


def test_a_seed_gives_the_same_organ_and_another_seed_another() -> None:
    assert np.array_equal(organ_surface(4).vertices, organ_surface(4).vertices)
    assert not np.allclose(organ_surface(4).vertices, organ_surface(5).vertices, atol=1e-3)


@pytest.mark.parametrize("roughness", [0.02, 0.04, 0.08])
def test_the_relief_of_a_rough_block_has_the_stated_height_and_mean_zero(roughness: float) -> None:
    block = rough_block(SIZE, roughness, seed=1, cells=(40, 40, 4))
    top = block.vertices[block.vertices[:, 2] > 0.003, 2]
    grid = block.vertices[np.isclose(block.vertices[:, 2], -0.005)]
    assert len(grid) == 41 * 41
    assert np.ptp(top) >= roughness * 0.01
    assert block.vertices[:, 2].max() - 0.005 < roughness * 0.01
    assert block.volume_m3 == pytest.approx(1e-4, rel=roughness / 10)
    for axis in (0, 1):
        assert np.ptp(block.vertices[:, axis]) == pytest.approx(0.1)


def test_reliefs_of_one_seed_differ_in_height_only() -> None:
    low, high = (rough_block(SIZE, roughness, seed=2, cells=(20, 20, 2)) for roughness in (0.02, 0.08))
    relief = [block.vertices[:, 2] - block_surface(SIZE, (20, 20, 2)).vertices[:, 2] for block in (low, high)]
    assert relief[1] == pytest.approx(4 * relief[0], abs=1e-12)


def test_a_ridged_multifractal_has_sharp_ridges_and_round_valleys() -> None:
    line = np.linspace(0.0, 8.0, 40_001)
    heights = ridged_multifractal(np.stack([line, np.full_like(line, 0.3)], axis=1), 3)
    bend = np.diff(heights, 2)
    assert -bend.min() > 20 * bend.max()
