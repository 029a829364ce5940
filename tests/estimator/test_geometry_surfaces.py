"""Closed surfaces: every file format is read, and what is no closed surface in metres is refused in one line."""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.geometry.shapes import block_surface, sphere_surface
from estimator.surfaces.queries import inside, nearest
from estimator.surfaces.reading import read_surface
from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface, directed_edges
from estimator.surfaces.writing import write_ply, write_stl

DATA = Path(__file__).resolve().parents[1] / "data" / "geometry"
SIZE = (0.1, 0.08, 0.01)
VOLUME = 8e-5

OBJ = """\
# a block of 100 x 80 x 10 mm, as quadrilaterals
v -0.05 -0.04 -0.005
v 0.05 -0.04 -0.005
v 0.05 0.04 -0.005
v -0.05 0.04 -0.005
v -0.05 -0.04 0.005
v 0.05 -0.04 0.005
v 0.05 0.04 0.005
v -0.05 0.04 0.005
vn 0 0 1
s off
f 1 4 3 2
f 5/1/1 6/2/1 7/3/1 8/4/1
f 1//1 2//1 6//1 5//1
f -7 -6 -2 -3
f 3 4 8 7
f 4 1 5 8
"""
PLY = """\
ply
format ascii 1.0
comment a block of 100 x 80 x 10 mm
element vertex 8
property float nx
property float x
property float y
property float z
element face 6
property list uchar int vertex_indices
property uchar red
end_header
0 -0.05 -0.04 -0.005
0 0.05 -0.04 -0.005
0 0.05 0.04 -0.005
0 -0.05 0.04 -0.005
0 -0.05 -0.04 0.005
0 0.05 -0.04 0.005
0 0.05 0.04 0.005
0 -0.05 0.04 0.005
4 0 3 2 1 7
4 4 5 6 7 7
4 0 1 5 4 7
4 1 2 6 5 7
4 2 3 7 6 7
4 3 0 4 7 7
"""


def stl_text(surface: Surface) -> str:
    facets = (
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in corners)
        + "endloop\nendfacet\n"
        for corners in surface.corners.tolist()
    )
    return f"solid block\n{''.join(facets)}endsolid block\n"


def ply_binary(order: str) -> bytes:
    """The block of ``PLY`` in binary: header and rows as the format's description has them."""
    header = PLY[: PLY.index("end_header") + len("end_header\n")]
    name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    rows = [line.split() for line in PLY[len(header) :].splitlines()]
    body = b"".join(struct.pack(f"{order}4f", *map(float, row)) for row in rows[:8])
    body += b"".join(struct.pack(f"{order}B4iB", 4, *map(int, row[1:5]), int(row[5])) for row in rows[8:])
    return header.replace("ascii", name).encode() + body


def assert_closed_and_outward(surface: Surface) -> None:
    edges = {tuple(edge) for edge in directed_edges(surface.triangles).tolist()}
    assert len(edges) == 3 * len(surface.triangles)
    assert {(b, a) for a, b in edges} == edges
    assert surface.volume_m3 > 0


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("block.obj", OBJ.encode()),
        ("block.ply", PLY.encode()),
        ("little.PLY", ply_binary("<")),
        ("big.ply", ply_binary(">")),
        ("text.stl", stl_text(block_surface(SIZE)).encode()),
    ],
)
def test_a_block_is_read_from_every_format(tmp_path: Path, name: str, content: bytes) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    surface = read_surface(file)
    assert len(surface.vertices) == 8
    assert len(surface.triangles) == 12
    assert surface.volume_m3 == pytest.approx(VOLUME, rel=1e-6)
    assert_closed_and_outward(surface)


@pytest.mark.parametrize("encoding", ["text", "inline_zlib", "appended_zlib"])
def test_a_file_written_by_vtk_is_read(encoding: str) -> None:
    surface = read_surface(DATA / f"block_{encoding}.vtp")
    assert surface.bounds == pytest.approx(np.array([[-0.05, -0.05, -0.005], [0.05, 0.05, 0.005]]), rel=1e-6)
    assert surface.volume_m3 == pytest.approx(1e-4, rel=1e-6)
    assert_closed_and_outward(surface)


@pytest.mark.parametrize(
    ("write", "suffix", "tolerance"), [(write_stl, "stl", 1e-7), (write_ply, "ply", 0.0)]
)
def test_what_is_written_is_read_again(
    tmp_path: Path, write: Callable[[Surface, Path], None], suffix: str, tolerance: float
) -> None:
    sphere = sphere_surface(0.03, 2)
    write(sphere, tmp_path / f"sphere.{suffix}")
    again = read_surface(tmp_path / f"sphere.{suffix}")
    assert len(again.vertices) == len(sphere.vertices)
    assert again.corners == pytest.approx(sphere.corners, rel=tolerance, abs=tolerance * 0.03)
    assert_closed_and_outward(again)


def test_triangles_are_turned_outward_whatever_their_order() -> None:
    block = block_surface(SIZE, (5, 4, 2))
    turned = np.random.default_rng(3).random(len(block.triangles)) < 0.5
    triangles = np.where(turned[:, None], block.triangles[:, ::-1], block.triangles)
    repaired = closed_surface(block.vertices, triangles, "block")
    assert_closed_and_outward(repaired)
    assert repaired.volume_m3 == pytest.approx(VOLUME)


def one_sided() -> NDArray[np.float64]:
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


def block_with_a_flat_triangle() -> NDArray[np.float64]:
    corners = block_surface(SIZE).corners
    a, b, c = corners[0]
    middle = (a + b) / 2
    return np.concatenate([corners[1:], [[a, middle, c], [middle, b, c], [a, b, middle]]])


BLOCK = block_surface(SIZE).corners


@pytest.mark.parametrize(
    ("corners", "complaint"),
    [
        (BLOCK[1:], "is open at 3 edges"),
        (np.concatenate([BLOCK, BLOCK[:1, ::-1], BLOCK[:1]]), "branches at 3 edges"),
        (1e3 * BLOCK, "in metres, not in millimetres"),
        (1e-3 * BLOCK, "in metres"),
        (np.concatenate([BLOCK, BLOCK + 0.2]), "2 separate shells"),
        (one_sided(), "one-sided"),
        (np.concatenate([BLOCK[:1], BLOCK[:1, ::-1], BLOCK[:1], BLOCK[:1]]), "branches"),
        (block_with_a_flat_triangle(), "1 triangles have no area"),
        (np.where(BLOCK > 0.04, np.nan, BLOCK), "not finite"),
        (BLOCK[:3], "3 triangles"),
    ],
)
def test_what_is_no_closed_surface_is_refused_in_one_line(
    corners: NDArray[np.float64], complaint: str
) -> None:
    triangles = np.arange(3 * len(corners)).reshape(-1, 3)
    with pytest.raises(InputError) as caught:
        closed_surface(corners.reshape(-1, 3), triangles, "scan.stl")
    message = str(caught.value)
    assert complaint in message
    assert message.startswith("scan.stl: ")
    assert "\n" not in message


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("a.obj", OBJ.replace("v 0.05 0.04 0.005", "v 0.05 0,04 0.005"), "a.obj, line 8: not understood"),
        ("a.obj", OBJ.replace("f 1 4 3 2", "f 1 4 3 0"), "a.obj, line 12: not understood"),
        ("a.obj", OBJ.replace("f 1 4 3 2", "f 1 4 9 2"), "face 0 (from 0) names [0, 3, 8, 1] of 8 vertices"),
        ("a.ply", PLY.replace("property float y", "property real y"), "a.ply, line 7: not understood"),
        ("a.ply", PLY.replace("ply\n", "poly\n", 1), "it has no header"),
        ("a.ply", PLY.replace("format ascii 1.0\n", ""), "names no known format"),
        ("a.ply", PLY[:-40], "face 3 (from 0) cannot be read"),
        ("a.ply", PLY.replace("property float z\n", ""), "vertex 0 (from 0) cannot be read"),
        ("a.ply", ply_binary("<")[:-9], "face 5 (from 0) cannot be read"),
        ("a.vtp", "<VTKFile type='PolyData'><PolyData>", "cannot be read as VTP"),
        ("a.vtp", "<VTKFile type='UnstructuredGrid'/>", "it holds UnstructuredGrid"),
        ("a.vtp", "<VTKFile type='PolyData' compressor='vtkLZ4DataCompressor'/>", "vtkLZ4DataCompressor"),
        ("a.stl", "solid nothing\nendsolid\n", "a.stl: not a complete STL file"),
        ("a.step", "ISO-10303-21;", "unknown kind of file"),
    ],
)
def test_a_broken_file_gives_one_line(
    tmp_path: Path, name: str, content: str | bytes, complaint: str
) -> None:
    file = tmp_path / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as caught:
        read_surface(file)
    assert complaint in str(caught.value)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kept_bytes", [0, 3, 20, 100, 250])
def test_a_compressed_file_that_is_cut_short_gives_one_line(tmp_path: Path, kept_bytes: int) -> None:
    content = (DATA / "block_appended_zlib.vtp").read_bytes()
    start = content.index(b"_", content.index(b"<AppendedData")) + 1
    (tmp_path / "cut.vtp").write_bytes(content[: start + kept_bytes])
    with pytest.raises(InputError, match=r"cut\.vtp: cannot be read as VTP [^\n]*$"):
        read_surface(tmp_path / "cut.vtp")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no such file"):
        read_surface(tmp_path / "liver.stl")


def test_a_file_too_large_is_refused_before_it_is_read(tmp_path: Path) -> None:
    with (tmp_path / "huge.stl").open("wb") as stream:
        stream.truncate(300_000_000)
    with pytest.raises(InputError, match="300 MB, and at most"):
        read_surface(tmp_path / "huge.stl")


def test_points_are_told_inside_from_outside() -> None:
    sphere = sphere_surface(0.05, 3)
    points = np.random.default_rng(0).uniform(-0.06, 0.06, (500, 3))
    radius = np.linalg.norm(points, axis=1)
    clear = np.abs(radius - 0.05) > 0.001
    assert np.array_equal(inside(sphere, points)[clear], radius[clear] < 0.05)


def test_the_nearest_point_of_a_block_is_found() -> None:
    half = np.array(SIZE) / 2
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (300, 3))
    points = points[np.any(np.abs(points) > half, axis=1)]
    surface = block_surface(SIZE)
    triangle, foot = nearest(surface.corners, points)
    assert foot == pytest.approx(np.clip(points, -half, half), abs=1e-12)
    normals = surface.area_vectors[triangle]
    assert np.einsum("px,px->p", foot - surface.corners[triangle, 0], normals) == pytest.approx(
        0.0, abs=1e-12
    )
