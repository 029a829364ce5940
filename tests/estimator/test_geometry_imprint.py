"""Imprinted regions: the surface stays closed, no triangle lies half in a region, and areas are the true ones."""

from itertools import pairwise

import numpy as np
import pytest

from estimator.errors import InputError
from estimator.experiment import Box
from estimator.geometry.holds import hold_regions
from estimator.geometry.imprint import imprint_box, imprint_levels, rim, triangles_in_box
from estimator.geometry.painted import Painted
from estimator.geometry.shapes import block_surface, sphere_surface
from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface

BLOCK = block_surface((0.1, 0.1, 0.01))
SPHERE = sphere_surface(0.05, 3)
END_FACE = Box((-0.0501, -0.0501, -0.0051), (-0.0499, 0.0501, 0.0051))
COLUMN = Box((0.03, -0.01, -0.0051), (0.05, 0.01, 0.0051))


def assert_closed(surface: Surface) -> None:
    again = closed_surface(surface.vertices, surface.triangles, "imprinted")
    assert len(again.triangles) == len(surface.triangles)
    assert np.array_equal(again.corners, surface.corners)


@pytest.mark.parametrize("surface", [BLOCK, SPHERE, block_surface((0.1, 0.1, 0.01), (7, 9, 2))])
def test_an_imprint_changes_neither_shape_nor_closedness(surface: Surface) -> None:
    box = Box((-0.013, -0.02, -0.06), (0.031, 0.017, 0.0031))
    imprinted, parent = imprint_box(surface, box, 0.0)
    assert len(imprinted.triangles) > len(surface.triangles)
    assert_closed(imprinted)
    assert imprinted.volume_m3 == pytest.approx(surface.volume_m3)
    areas = np.bincount(parent, imprinted.areas, minlength=len(surface.triangles))
    assert areas == pytest.approx(surface.areas)


def test_after_an_imprint_every_triangle_is_in_the_box_or_out_of_it() -> None:
    box = Box((-0.02, -0.03, 0.0), (0.01, 0.02, 0.06))
    imprinted, _ = imprint_box(SPHERE, box, 0.0)
    held = triangles_in_box(imprinted, box)
    lower, upper = np.array(box.lower), np.array(box.upper)
    inner = np.all((imprinted.corners >= lower - 1e-12) & (imprinted.corners <= upper + 1e-12), axis=(1, 2))
    outer = np.any(
        np.all(imprinted.corners <= lower + 1e-12, axis=1)
        | np.all(imprinted.corners >= upper - 1e-12, axis=1),
        axis=1,
    )
    assert held.any()
    assert np.all(inner | outer)
    assert np.array_equal(held, inner)


def test_the_rim_runs_along_the_faces_of_the_box_in_one_loop() -> None:
    imprinted, _ = imprint_box(BLOCK, Box((0.0, -0.02, 0.0), (0.03, 0.02, 0.01)), 0.0)
    edges = rim(imprinted, triangles_in_box(imprinted, Box((0.0, -0.02, 0.0), (0.03, 0.02, 0.01))))
    after = dict(edges.tolist())
    loop = [edges[0, 0]]
    while after[loop[-1]] != loop[0]:
        loop.append(after[loop[-1]])
    assert len(loop) == len(edges)
    points = imprinted.vertices[[*loop, loop[0]]]
    length = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
    assert length == pytest.approx(2 * (0.03 + 0.04))


def test_a_box_face_beside_an_edge_of_the_body_means_the_edge() -> None:
    body = hold_regions(BLOCK, {"anchor": END_FACE}, 0.01)
    assert len(body.surface.triangles) == len(BLOCK.triangles)
    assert body.holds["anchor"].core is None
    assert body.holds["anchor"].area_m2 == pytest.approx(0.1 * 0.01)


def test_a_box_that_reaches_into_the_tissue_cuts_it_away() -> None:
    hold = hold_regions(BLOCK, {"grasp": COLUMN}, 0.01).holds["grasp"]
    assert hold.core is not None
    assert hold.area_m2 == pytest.approx((0.02 + 0.02 + 0.02) * 0.01)
    assert hold.volume_m3 == pytest.approx(0.02 * 0.02 * 0.01)


def test_walls_and_fins_stand_out_of_the_body() -> None:
    body = hold_regions(
        BLOCK, {"grasp": COLUMN, "anchor": Box((-0.05, -0.02, 0.0049), (-0.03, 0.02, 0.0051))}, 0.01
    )
    for hold in body.holds.values():
        assert hold.walls[:, :, 2].max() == pytest.approx(0.015, abs=1e-3)


@pytest.mark.parametrize("depth", [0.02, 0.07])
def test_area_and_volume_of_a_cut_through_a_sphere_are_those_of_its_cap(depth: float) -> None:
    left = Box((-0.06, -0.06, -0.06), (depth - 0.05, 0.06, 0.06))
    hold = hold_regions(sphere_surface(0.05, 4), {"anchor": left}, 0.01).holds["anchor"]
    assert hold.area_m2 == pytest.approx(np.pi * depth * (0.1 - depth), rel=5e-3)
    assert hold.volume_m3 == pytest.approx(np.pi * depth**2 * (0.15 - depth) / 3, rel=5e-3)


def test_a_box_inside_the_tissue_has_six_walls() -> None:
    box = Box((-0.01, -0.01, -0.01), (0.01, 0.005, 0.01))
    hold = hold_regions(SPHERE, {"anchor": box}, 0.01).holds["anchor"]
    assert not hold.patch.any()
    assert hold.area_m2 == pytest.approx(2 * (0.02 * 0.02 + 2 * 0.015 * 0.02))
    assert hold.volume_m3 == pytest.approx(0.02 * 0.02 * 0.015)


def test_a_painted_patch_survives_the_imprint_of_a_box_across_it() -> None:
    painted = Painted(-0.02 - SPHERE.vertices[:, 2])
    grasp = Box((0.0, -0.01, -0.03), (0.06, 0.01, 0.0))
    alone = hold_regions(SPHERE, {"anchor": painted}, 0.01)
    body = hold_regions(SPHERE, {"anchor": painted, "grasp": grasp}, 0.01)
    assert body.holds["anchor"].area_m2 == pytest.approx(alone.holds["anchor"].area_m2)


def test_the_rim_of_a_level_is_where_it_is_zero() -> None:
    levels = np.stack([-0.02 - SPHERE.vertices[:, 2], SPHERE.vertices @ [0.6, 0.8, 0.0] - 0.03], axis=1)
    imprinted, patches = imprint_levels(SPHERE, levels)
    assert_closed(imprinted)
    assert imprinted.volume_m3 == pytest.approx(SPHERE.volume_m3)
    for patch, normal, place in zip(
        patches.T, ([0.0, 0.0, -1.0], [0.6, 0.8, 0.0]), (0.02, 0.03), strict=True
    ):
        assert imprinted.vertices[rim(imprinted, patch)] @ normal == pytest.approx(place)
        assert (imprinted.corners[patch] @ normal).min() == pytest.approx(place)
        assert (imprinted.corners[~patch] @ normal).max() == pytest.approx(place)


@pytest.mark.parametrize(
    ("box", "held"),
    [
        (Box((0.2, 0.2, 0.2), (0.3, 0.3, 0.3)), "no tissue"),
        (Box((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1)), "all of the tissue"),
    ],
)
def test_a_region_that_holds_nothing_or_everything_is_refused_by_name(box: Box, held: str) -> None:
    with pytest.raises(InputError, match=f"^anchor 2 holds {held}; correct its box"):
        hold_regions(SPHERE, {"anchor 2": box}, 0.01)
