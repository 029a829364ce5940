"""Polygon soups: repaired where that has one meaning, with a word on it, and refused by name where it has not."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from surface_files import BLOCK_FACES, BLOCK_VERTICES, BLOCK_VOLUME

from estimator.errors import InputError
from estimator.geometry.organ import organ_surface
from estimator.geometry.shapes import block_surface, sphere_surface
from estimator.surfaces import decimation
from estimator.surfaces.crossings import crossings
from estimator.surfaces.formats.soup import (
    PolygonSoup,
    soup_of_corners,
    soup_of_triangles,
    triangles_of_strip,
)
from estimator.surfaces.queries import inside, nearest
from estimator.surfaces.repair import RepairedSurface, closed_surface, repaired
from estimator.surfaces.surface import Surface, directed_edges
from estimator.surfaces.triangulation import triangulate

FloatArray = NDArray[np.float64]

SIZE = (0.1, 0.08, 0.01)
BLOCK = block_surface(SIZE).corners


def of_corners(*parts: FloatArray) -> RepairedSurface:
    return repaired(soup_of_corners(np.concatenate(parts)), "scan.stl")


def of_faces(vertices: object, faces: list[list[int]]) -> RepairedSurface:
    nodes = np.array([node for face in faces for node in face], dtype=np.int64)
    ends = np.cumsum([len(face) for face in faces], dtype=np.int64)
    return repaired(PolygonSoup(np.array(vertices, dtype=np.float64), nodes, ends), "scan.obj")


def complaint(*parts: FloatArray) -> str:
    with pytest.raises(InputError) as caught:
        of_corners(*parts)
    assert str(caught.value).startswith("scan.stl: ")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def assert_closed_and_outward(surface: Surface) -> None:
    edges = {tuple(edge) for edge in directed_edges(surface.triangles).tolist()}
    assert len(edges) == 3 * len(surface.triangles)
    assert {(b, a) for a, b in edges} == edges
    assert surface.volume_m3 > 0
    assert surface.areas.min() > 0


def prism(outline: FloatArray, height: float = 0.01) -> tuple[FloatArray, list[list[int]]]:
    """A prism on an outline (n, 2) that turns anticlockwise: two caps of n corners, and rectangles between them."""
    count = len(outline)
    vertices = np.concatenate([np.column_stack([outline, np.full(count, z)]) for z in (0.0, height)])
    sides = [[i, (i + 1) % count, count + (i + 1) % count, count + i] for i in range(count)]
    return vertices, [list(range(count))[::-1], list(range(count, 2 * count)), *sides]


def area(outline: FloatArray) -> float:
    x, y = outline.T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


@st.composite
def outlines(draw: st.DrawFn) -> FloatArray:
    """Outlines seen whole from one point, mostly concave, with corners on some straight sides."""
    count = draw(st.integers(3, 12))
    radii = np.array(draw(st.lists(st.floats(0.015, 0.05), min_size=count, max_size=count)))
    angles = 2 * np.pi * np.arange(count) / count
    corners = radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    between = draw(st.lists(st.integers(0, 3), min_size=count, max_size=count))
    rows = []
    for (a, b), extra in zip(pairwise([*corners, corners[0]]), between, strict=True):
        rows += [a + share * (b - a) for share in np.arange(extra + 1) / (extra + 1)]
    return np.roll(np.array(rows), draw(st.integers(0, len(rows) - 1)), axis=0)


@settings(deadline=None)
@given(outline=outlines(), turn=st.integers(0, 2))
def test_polygons_are_split_without_losing_a_corner_or_making_a_flat_triangle(
    outline: FloatArray, turn: int
) -> None:
    vertices, faces = prism(outline)
    found = of_faces(np.roll(vertices, turn, axis=1), faces)
    assert found.surface.volume_m3 == pytest.approx(0.01 * area(outline), rel=1e-9)
    assert len(found.surface.vertices) == 2 * len(outline)
    assert len(found.surface.triangles) == 4 * len(outline) - 4
    assert found.repairs == ()
    assert_closed_and_outward(found.surface)


@settings(deadline=None)
@given(outline=outlines())
def test_triangles_of_a_polygon_cover_it_once(outline: FloatArray) -> None:
    points = np.column_stack([outline, np.zeros(len(outline))])
    ring = np.arange(len(points))
    triangles = triangulate(points, ring, np.array([len(ring)]), "ring")
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    doubled = np.cross(b - a, c - a)[:, 2]
    assert np.all(doubled > 0)
    assert doubled.sum() / 2 == pytest.approx(area(outline))


def test_a_comb_of_many_corners_is_split() -> None:
    teeth = 40
    x = np.repeat(np.linspace(0.0, 0.1, 2 * teeth), 2)
    y = np.tile([0.002, 0.04, 0.04, 0.002], teeth)
    outline = np.concatenate([[[0.0, 0.0], [0.1, 0.0]], np.column_stack([x, y])[::-1]])
    vertices, faces = prism(outline)
    assert of_faces(vertices, faces).surface.volume_m3 == pytest.approx(0.01 * area(outline))


def test_strips_alternate() -> None:
    assert triangles_of_strip([0, 1, 2, 3, 4]).tolist() == [[0, 1, 2], [3, 2, 1], [2, 3, 4]]
    assert triangles_of_strip([0, 1]).shape == (0, 3)


def with_flat(corners: FloatArray, number: int, side: int, shares: list[float]) -> FloatArray:
    """Split one triangle at points on one of its sides, and close the gap with triangles without area."""
    a, b, c = np.roll(corners[number], -side, axis=0)
    way = [a, *(a + share * (b - a) for share in sorted(shares)), b]
    fan = [[one, other, c] for one, other in pairwise(way)]
    flat = [[way[0], other, one] for one, other in pairwise(way[1:])]
    return np.concatenate([np.delete(corners, number, axis=0), fan, flat])


shares = st.lists(st.floats(0.01, 0.99), min_size=1, max_size=6, unique_by=lambda share: round(share, 2))


@settings(deadline=None)
@given(number=st.integers(0, 319), side=st.integers(0, 2), shares=shares)
def test_triangles_without_area_are_turned_into_their_neighbours(
    number: int, side: int, shares: list[float]
) -> None:
    sphere = sphere_surface(0.05, 2)
    found = of_corners(with_flat(sphere.corners, number, side, shares))
    assert_closed_and_outward(found.surface)
    assert found.surface.volume_m3 == pytest.approx(sphere.volume_m3, rel=1e-9)
    assert len(found.surface.vertices) == len(sphere.vertices) + len(shares)
    assert len(found.surface.triangles) == len(sphere.triangles) + 2 * len(shares)


@settings(deadline=None)
@given(number=st.integers(0, 319), side=st.integers(0, 2), shares=shares)
def test_corners_on_the_edge_of_another_triangle_are_joined_to_it(
    number: int, side: int, shares: list[float]
) -> None:
    sphere = sphere_surface(0.05, 2)
    split = with_flat(sphere.corners, number, side, shares)[: -len(shares)]
    found = of_corners(split)
    assert_closed_and_outward(found.surface)
    assert found.surface.volume_m3 == pytest.approx(sphere.volume_m3, rel=1e-9)
    assert found.repairs == ("split 1 triangles at corners that lay on their edges",)


@given(doubled=st.sets(st.integers(0, 11), min_size=1), turned=st.booleans())
def test_faces_that_stand_twice_are_left_out(doubled: set[int], turned: bool) -> None:
    again = BLOCK[sorted(doubled)]
    found = of_corners(BLOCK, again[:, ::-1] if turned else again)
    assert found.repairs[0] == f"left out {len(doubled)} triangles that stood twice"
    assert found.surface.volume_m3 == pytest.approx(BLOCK_VOLUME)
    assert len(found.surface.triangles) == 12


def test_a_sheet_of_no_thickness_on_the_surface_is_left_out() -> None:
    a, b = BLOCK[0, 0], BLOCK[0, 1]
    fin = np.array([[a, b, (a + b) / 2 + [0.0, 0.0, -0.02]]])
    found = of_corners(BLOCK, fin, fin[:, ::-1])
    assert found.surface.volume_m3 == pytest.approx(BLOCK_VOLUME)
    assert found.repairs == ("left out 2 triangles that stood twice",)


def test_vertices_that_stand_twice_are_merged() -> None:
    faces = [[node + 8 * (number % 2) for node in face] for number, face in enumerate(BLOCK_FACES)]
    found = of_faces([*BLOCK_VERTICES, *BLOCK_VERTICES], faces)
    assert found.repairs == ("merged 8 vertices that stood twice",)
    assert len(found.surface.vertices) == 8


def test_faces_whose_corners_coincide_are_left_out() -> None:
    found = of_faces(BLOCK_VERTICES, [*BLOCK_FACES, [0, 1, 1], [2, 2, 2, 2]])
    assert found.repairs == ("left out 2 faces whose corners coincide",)
    assert found.surface.volume_m3 == pytest.approx(BLOCK_VOLUME)


@given(turned=st.lists(st.booleans(), min_size=12, max_size=12))
def test_triangles_are_turned_outward_whatever_their_order(turned: list[bool]) -> None:
    found = of_corners(np.where(np.array(turned)[:, None, None], BLOCK[:, ::-1], BLOCK))
    assert_closed_and_outward(found.surface)
    assert found.surface.volume_m3 == pytest.approx(BLOCK_VOLUME)
    expected = {
        0: [],
        12: ["turned the surface, which was inside out"],
    }.get(sum(turned), [f"turned {sum(turned)} triangles that faced the wrong way"])
    assert list(found.repairs) == expected


BALL = sphere_surface(0.05, 2)


def sphere(radius: float, centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> FloatArray:
    return radius * BALL.corners / 0.05 + centre


def volume(radius: float) -> float:
    return (radius / 0.05) ** 3 * BALL.volume_m3


@pytest.mark.parametrize("inner_turned", [False, True])
@pytest.mark.parametrize("outer_turned", [False, True])
@pytest.mark.parametrize("radius", [0.001, 0.01, 0.03])
def test_a_shell_within_is_a_cavity_however_it_is_turned(
    radius: float, outer_turned: bool, inner_turned: bool
) -> None:
    outer, inner = sphere(0.05), sphere(radius, (0.01, 0.0, 0.0))
    found = of_corners(outer[:, ::-1] if outer_turned else outer, inner[:, ::-1] if inner_turned else inner)
    assert found.surface.volume_m3 == pytest.approx(volume(0.05) - volume(radius))
    assert found.repairs[0] == f"left 1 cavity of {volume(radius) * 1e6:.3g} cm3 empty"
    points = np.array([[0.01, 0.0, 0.0], [-0.045, 0.0, 0.0], [0.06, 0.0, 0.0]])
    assert inside(found.surface, points).tolist() == [False, True, False]


@pytest.mark.parametrize("apart", [1e-7, 1e-6, 1e-5])
@pytest.mark.parametrize("turned", [False, True])
def test_a_surface_that_stands_twice_is_no_body_around_a_cavity(apart: float, turned: bool) -> None:
    """As of scans that were smoothed, rounded or thickened by nothing."""
    inner = sphere(0.05 - apart)
    assert "the surface stands twice, one shell close within the other" in complaint(
        sphere(0.05), inner[:, ::-1] if turned else inner
    )


def test_a_thin_wall_around_a_cavity_is_a_body() -> None:
    found = of_corners(sphere(0.05), sphere(0.0495))
    assert found.surface.volume_m3 == pytest.approx(volume(0.05) - volume(0.0495))


def test_several_cavities_are_left_empty() -> None:
    inner = [sphere(0.01, (x, 0.0, 0.0)) for x in (-0.025, 0.0, 0.025)]
    found = of_corners(sphere(0.05), *inner)
    assert found.surface.volume_m3 == pytest.approx(volume(0.05) - 3 * volume(0.01))
    assert found.repairs[0].startswith("left 3 cavities")


@given(
    places=st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=1, max_size=5, unique=True),
    radius=st.floats(0.0005, 0.004),
)
@settings(deadline=None, max_examples=20)
def test_tiny_islands_are_dropped_with_a_word(places: list[tuple[int, int]], radius: float) -> None:
    islands = [sphere(radius, (0.02 * x, 0.02 * y, 0.08)) for x, y in places]
    found = of_corners(sphere(0.05), *islands)
    assert found.surface.volume_m3 == pytest.approx(volume(0.05))
    word = "island" if len(places) == 1 else "islands"
    assert found.repairs[0].startswith(f"dropped {len(places)} {word} of ")


def test_an_island_in_a_cavity_goes_and_the_cavity_of_an_island_with_it() -> None:
    crumb, hollow = sphere(0.002), (sphere(0.004, (0.1, 0.0, 0.0)), sphere(0.002, (0.1, 0.0, 0.0)))
    found = of_corners(sphere(0.05), sphere(0.02), crumb, *hollow)
    assert found.surface.volume_m3 == pytest.approx(volume(0.05) - volume(0.02))
    assert [repair.split(" of ")[0] for repair in found.repairs[:2]] == ["left 1 cavity", "dropped 3 islands"]


def test_a_second_body_is_refused_by_name() -> None:
    message = complaint(sphere(0.05), sphere(0.02, (0.1, 0.0, 0.0)))
    assert "2 separate bodies, the largest of" in message
    assert f"then {volume(0.02) * 1e6:.3g} cm3" in message
    assert "2 separate bodies" in complaint(sphere(0.05), sphere(0.04), sphere(0.03))


def test_shells_that_cross_are_refused_by_name() -> None:
    assert "two shells of the surface cross" in complaint(sphere(0.05), sphere(0.03, (0.05, 0.0, 0.0)))


def one_sided() -> FloatArray:
    """A Klein bottle as an immersed grid: closed, every edge with two triangles, but one-sided."""
    n = 12
    u, v = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    a, b = 2 * np.pi * u / n, 2 * np.pi * (v + 0.5) / n
    r = 2 + np.cos(a / 2) * np.sin(b) - np.sin(a / 2) * np.sin(2 * b)
    z = np.sin(a / 2) * np.sin(b) + np.cos(a / 2) * np.sin(2 * b)
    p = 0.02 * np.round(np.stack([r * np.cos(a), r * np.sin(a), z], axis=-1), 9)
    lower = np.stack([p[:-1, :-1], p[1:, :-1], p[1:, 1:]], axis=2)
    upper = np.stack([p[:-1, :-1], p[1:, 1:], p[:-1, 1:]], axis=2)
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3)])


FIN = np.array([[BLOCK[0, 0], BLOCK[0, 1], [0.0, 0.0, -0.02]]])


@pytest.mark.parametrize(
    ("corners", "found"),
    [
        (BLOCK[1:], "is open at 3 edges"),
        (np.concatenate([BLOCK, FIN]), "is open at 2 edges"),
        (np.concatenate([BLOCK, BLOCK + np.array([0.1, 0.08, 0.0])]), "branches at 1 edges"),
        (one_sided(), "one-sided"),
        (np.where(BLOCK > 0.04, np.nan, BLOCK), "not finite"),
        (BLOCK[:3], "3 triangles; a closed surface takes 4"),
        (np.concatenate([BLOCK[:2], BLOCK[:2, ::-1]]), "0 triangles"),
    ],
)
def test_what_has_no_one_meaning_is_refused_in_one_line(corners: FloatArray, found: str) -> None:
    assert found in complaint(corners)


def test_a_face_of_too_many_corners_is_refused() -> None:
    angles = np.linspace(0.0, 2 * np.pi, 30_001)[:-1]
    with pytest.raises(InputError, match="a face has 30000 corners"):
        of_faces(*prism(0.05 * np.stack([np.cos(angles), np.sin(angles)], axis=1)))


def test_a_surface_of_very_many_triangles_is_decimated_within_the_envelope(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(decimation, "MOST_TRIANGLES", 10_000)
    organ = organ_surface(1, 0.12, 4)
    a, b, c = np.moveaxis(organ.corners, 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    split = np.concatenate(
        [np.stack(one, axis=1) for one in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    )
    found = of_corners(split)
    assert len(found.surface.triangles) <= 10_000 < len(split)
    assert_closed_and_outward(found.surface)
    _, foot = nearest(found.surface.corners, organ.vertices)
    off = np.linalg.norm(foot - organ.vertices, axis=1).max()
    assert off < 0.004 * organ.volume_m3 ** (1 / 3)
    (told,) = found.repairs
    assert told.startswith(f"decimated {len(split)} triangles to {len(found.surface.triangles)}, which moves")


def test_a_surface_that_crosses_itself_is_found_out() -> None:
    ball = sphere_surface(0.05, 3)
    assert len(crossings(ball)) == 0
    x, y, z = ball.vertices.T
    dent = 0.14 * np.exp(-(x**2 + y**2) / 0.01**2) * (z > 0)
    dented = closed_surface(np.column_stack([x, y, z - dent]), ball.triangles, "ball")
    places = crossings(dented)
    assert len(places) > 10
    assert np.abs(np.linalg.norm(places, axis=1) - 0.05).max() < 0.002


def test_points_are_told_inside_from_outside() -> None:
    ball = sphere_surface(0.05, 3)
    points = np.random.default_rng(0).uniform(-0.06, 0.06, (2000, 3))
    radius = np.linalg.norm(points, axis=1)
    clear = np.abs(radius - 0.05) > 0.0005
    assert np.array_equal(inside(ball, points)[clear], radius[clear] < 0.05)


def test_the_nearest_point_of_a_block_is_found() -> None:
    half = np.array(SIZE) / 2
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (300, 3))
    points = points[np.any(np.abs(points) > half, axis=1)]
    surface = block_surface(SIZE, (9, 8, 3))
    triangle, foot = nearest(surface.corners, points)
    assert foot == pytest.approx(np.clip(points, -half, half), abs=1e-12)
    normals = surface.area_vectors[triangle]
    assert np.einsum("px,px->p", foot - surface.corners[triangle, 0], normals) == pytest.approx(
        0.0, abs=1e-12
    )


def test_triangles_given_by_number_are_read_as_they_stand() -> None:
    block = block_surface(SIZE)
    assert repaired(soup_of_triangles(block.vertices, block.triangles), "block").repairs == ()


@pytest.mark.parametrize("apart", [1e-10, 1e-9, 1e-8, 1e-7, 1e-6])
def test_vertices_that_were_rounded_apart_are_joined_and_told(apart: float) -> None:
    corners = sphere_surface(0.05, 3).corners
    moved = corners + apart * np.random.default_rng(3).uniform(-0.4, 0.4, corners.shape)
    found = of_corners(moved)
    assert_closed_and_outward(found.surface)
    assert found.surface.volume_m3 == pytest.approx(
        repaired(soup_of_corners(corners), "a").surface.volume_m3, rel=1e-3
    )
    assert any("joined vertices" in word for word in found.repairs) == (apart >= 1e-7)


def test_a_hole_is_not_joined_over() -> None:
    assert "is open at" in complaint(sphere_surface(0.05, 3).corners[:-1])
