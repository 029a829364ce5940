"""Surface files: every format and way to write it is read, told by its content, and what cannot be read is named."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from surface_files import (
    BLOCK_FACES,
    BLOCK_VERTICES,
    BLOCK_VOLUME,
    COMPRESSORS,
    faces_of,
    obj_text,
    ply_file,
    stl_binary,
    stl_text,
    vtp_file,
)

from estimator.errors import InputError
from estimator.geometry.shapes import block_surface, sphere_surface
from estimator.surfaces.reading import read_surface, surface_bounds
from estimator.surfaces.surface import Surface, directed_edges
from estimator.surfaces.units import UNITS
from estimator.surfaces.writing import write_ply, write_stl

DATA = Path(__file__).resolve().parents[1] / "data" / "geometry"
SIZE = (0.1, 0.08, 0.01)
CORNERS = block_surface(SIZE).corners
STL = stl_binary(CORNERS)
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
f -7 -6 \\
-2 -3
f 3 4 8 7
f 4 1 5 8
"""
PLY = ply_file(BLOCK_VERTICES, BLOCK_FACES).decode()
FILES: dict[str, bytes] = {
    "stl, binary": STL,
    "stl, binary, 'solid' in the header": stl_binary(CORNERS, b"solid block exported from CAD"),
    "stl, text": stl_text(CORNERS).encode(),
    "stl, text in capitals": stl_text(CORNERS).upper().encode(),
    "stl, text behind spaces": b" \r\n\t" + stl_text(CORNERS).encode(),
    "stl, text in two solids": (stl_text(CORNERS[:5]) + stl_text(CORNERS[5:])).encode(),
    "stl, text in UTF-16": stl_text(CORNERS).encode("utf-16"),
    "obj": OBJ.encode(),
    "ply, text": PLY.encode(),
    "ply, little endian": ply_file(BLOCK_VERTICES, BLOCK_FACES, "binary_little_endian"),
    "ply, big endian": ply_file(BLOCK_VERTICES, BLOCK_FACES, "binary_big_endian"),
    "vtp": vtp_file(BLOCK_VERTICES, BLOCK_FACES),
    "vtp, binary": vtp_file(BLOCK_VERTICES, BLOCK_FACES, form="binary"),
    "vtp in UTF-16": vtp_file(BLOCK_VERTICES, BLOCK_FACES).decode().encode("utf-16"),
}
TEXTS = [name for name in FILES if "text" in name or name in ("obj", "vtp")]


def read(folder: Path, content: bytes, name: str = "surface") -> Surface:
    file = folder / name
    file.write_bytes(content)
    return read_surface(file).surface


def repairs(folder: Path, content: bytes, name: str = "surface.stl") -> tuple[str, ...]:
    file = folder / name
    file.write_bytes(content)
    return read_surface(file).repairs


def complaint(folder: Path, content: bytes, name: str) -> str:
    file = folder / name
    file.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_surface(file)
    message = str(caught.value)
    assert message.startswith(f"{file}")
    assert "\n" not in message
    return message


def assert_closed_and_outward(surface: Surface) -> None:
    edges = {tuple(edge) for edge in directed_edges(surface.triangles).tolist()}
    assert len(edges) == 3 * len(surface.triangles)
    assert {(b, a) for a, b in edges} == edges
    assert surface.volume_m3 > 0


def assert_is_the_block(surface: Surface) -> None:
    assert len(surface.vertices) == 8
    assert len(surface.triangles) == 12
    assert surface.volume_m3 == pytest.approx(BLOCK_VOLUME, rel=1e-6)
    assert_closed_and_outward(surface)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".vtp", ".PLY", ".dat", ""])
@pytest.mark.parametrize("form", FILES)
def test_a_format_is_told_by_its_content_whatever_the_file_is_called(
    tmp_path: Path, form: str, suffix: str
) -> None:
    assert_is_the_block(read(tmp_path, FILES[form], f"block{suffix}"))
    assert repairs(tmp_path, FILES[form], f"block{suffix}") == ()


@pytest.mark.parametrize("line_end", [b"\r\n", b"\r"])
@pytest.mark.parametrize("form", TEXTS)
def test_line_ends_of_any_system_will_do(tmp_path: Path, form: str, line_end: bytes) -> None:
    content = FILES[form]
    if "UTF-16" in form:
        content = content.decode("utf-16").replace("\n", line_end.decode()).encode("utf-16")
    assert_is_the_block(read(tmp_path, content.replace(b"\n", line_end) if "16" not in form else content))


@pytest.mark.parametrize("form", ["binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("line_end", [b"\r\n", b"\r"])
def test_the_header_of_a_binary_ply_has_line_ends_of_any_system(
    tmp_path: Path, form: str, line_end: bytes
) -> None:
    head, separator, body = ply_file(BLOCK_VERTICES, BLOCK_FACES, form).partition(b"end_header\n")
    content = (head + separator).replace(b"\n", line_end) + body
    assert_is_the_block(read(tmp_path, content))


@pytest.mark.parametrize("header", ["UInt32", "UInt64"])
@pytest.mark.parametrize("order", ["LittleEndian", "BigEndian"])
@pytest.mark.parametrize("compressor", [None, *COMPRESSORS])
@pytest.mark.parametrize(("form", "encoding"), [("binary", ""), ("appended", "raw"), ("appended", "base64")])
def test_every_way_in_which_vtk_writes_arrays_is_read(
    tmp_path: Path, form: str, encoding: str, compressor: str | None, order: str, header: str
) -> None:
    content = vtp_file(
        BLOCK_VERTICES,
        BLOCK_FACES[:4],
        [[2, 3, 6, 7], [3, 0, 7, 4]],
        form=form,
        encoding=encoding,
        compressor=compressor,
        order=order,
        header=header,
    )
    assert_is_the_block(read(tmp_path, content))


@pytest.mark.parametrize("encoding", ["text", "inline_zlib", "appended_zlib"])
def test_a_file_written_by_vtk_is_read(encoding: str) -> None:
    surface = read_surface(DATA / f"block_{encoding}.vtp").surface
    assert surface.bounds == pytest.approx(np.array([[-0.05, -0.05, -0.005], [0.05, 0.05, 0.005]]), rel=1e-6)
    assert surface.volume_m3 == pytest.approx(1e-4, rel=1e-6)
    assert_closed_and_outward(surface)


def test_strips_of_a_ply_file_are_read(tmp_path: Path) -> None:
    strips = [4, 5, 7, 6, -1, 0, 1, 3, 2, -1, 0, 4, 1, 5, 2, 6, 3, 7, 0, 4]
    header = (
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    )
    rows = [" ".join(map(str, vertex)) for vertex in BLOCK_VERTICES]
    rows.append(" ".join(map(str, [len(strips), *strips])))
    assert_is_the_block(read(tmp_path, (header + "\n".join(rows) + "\n").encode()))


@pytest.mark.parametrize(
    ("write", "suffix", "tolerance"), [(write_stl, "stl", 1e-7), (write_ply, "ply", 0.0)]
)
def test_what_is_written_is_read_again(
    tmp_path: Path, write: Callable[[Surface, Path], None], suffix: str, tolerance: float
) -> None:
    sphere = sphere_surface(0.03, 2)
    write(sphere, tmp_path / f"sphere.{suffix}")
    again = read_surface(tmp_path / f"sphere.{suffix}").surface
    assert len(again.vertices) == len(sphere.vertices)
    assert again.corners == pytest.approx(sphere.corners, rel=tolerance, abs=tolerance * 0.03)
    assert_closed_and_outward(again)


def test_every_format_gives_the_same_surface(tmp_path: Path) -> None:
    sphere = sphere_surface(0.03, 2)
    single = Surface(sphere.vertices.astype(np.float32).astype(np.float64), sphere.triangles)
    faces = faces_of(single)
    contents = [
        stl_binary(single.corners),
        stl_text(single.corners).encode(),
        obj_text(*faces).encode(),
        ply_file(*faces, "binary_big_endian"),
        vtp_file(*faces, form="binary", compressor="vtkLZ4DataCompressor"),
    ]
    surfaces = [read(tmp_path, content, str(number)) for number, content in enumerate(contents)]
    assert all(np.array_equal(one.vertices, surfaces[0].vertices) for one in surfaces)
    assert all(one.volume_m3 == pytest.approx(surfaces[0].volume_m3, rel=1e-12) for one in surfaces)


@given(extra=st.integers(1, 200).filter(lambda n: n % 50), byte=st.integers(0, 255))
def test_bytes_behind_the_last_triangle_are_left_out_and_counted(
    tmp_path_factory: pytest.TempPathFactory, extra: int, byte: int
) -> None:
    folder = tmp_path_factory.getbasetemp()
    content = STL + bytes([byte]) * extra
    assert_is_the_block(read(folder, content, "trailing.stl"))
    assert repairs(folder, content, "trailing.stl") == (
        f"{extra} bytes behind the last triangle were left out",
    )


@pytest.mark.parametrize("count", [0, 2**32 - 1])
def test_a_count_that_was_never_filled_in_is_told_from_the_size(tmp_path: Path, count: int) -> None:
    content = stl_binary(CORNERS, count=count)
    assert_is_the_block(read(tmp_path, content, "a.stl"))
    assert f"the header counts {count} triangles; the 12 for which" in repairs(tmp_path, content)[0]


@pytest.mark.parametrize(
    ("name", "content", "found"),
    [
        ("a.stl", b"", "is empty"),
        ("a.stl", bytes(500), "is empty"),
        ("a.stl", b"\0\1" + STL[:48], "50 bytes, where the header of a binary STL file alone takes 84"),
        ("a.stl", STL[:-7], "counts 12 triangles and there is room for 11 in the file: it is cut short"),
        ("a.stl", stl_binary(CORNERS, count=0)[:-7], "its header counts 0 triangles"),
        ("a.stl", STL[:96] + b"\xff\xff\xff\x7f" + STL[100:], "triangle 0 (from 0) has a corner that is no finite"),
        ("a.stl", b"solid nothing\nendsolid\n", "a text STL without a facet"),
        ("a.stl", stl_text(CORNERS).encode()[:900], "ends within facet"),
        ("a.stl", stl_text(CORNERS).replace("0.05", "0,05").encode(), "'-0,05', which is no number"),
        ("a.stl", stl_text(CORNERS).replace("0.05", "nan").encode(), "is not finite"),
        ("a.stl", b"PK\x03\x04" + bytes(300), "is a ZIP archive, such as 3MF"),
        ("a.stl", b"\x1f\x8b\x08" + bytes(300), "is compressed by gzip; unpack it"),
        ("a.stl", b"<html><body>404</body></html>", "is XML or HTML, but no VTK file"),
        ("a.step", b"ISO-10303-21;", "is a STEP file"),
        ("a.vtk", b"# vtk DataFile Version 3.0\n", "a legacy VTK file; save it as VTP"),
        ("a.off", b"OFF\n8 6 12\n", "is an OFF file"),
        ("a.obj", b"what is this", "is neither STL, PLY, OBJ or VTP: it begins with b'what is this'"),
        ("a.obj", OBJ.replace("v 0.05 0.04 0.005", "v 0.05 0,04 0.005").encode(), "a.obj, line 8: not understood"),
        ("a.obj", OBJ.replace("f 1 4 3 2", "f 1 4 3 0").encode(), "a.obj, line 12: not understood"),
        ("a.obj", OBJ.replace("f 1 4 3 2", "f 1 4").encode(), "a.obj, line 12: not understood"),
        ("a.obj", OBJ.replace("f 1 4 3 2", "f 1 4 9 2").encode(), "face 0 (from 0) names [0, 3, 8, 1] of 8 vertices"),
        ("a.obj", OBJ.replace("f ", "p ").encode(), "0 faces"),
        ("a.ply", PLY.replace("property float y", "property real y").encode(), "a.ply, line 7: not understood"),
        ("a.ply", PLY.replace("element face 6", "element face -6").encode(), "a.ply, line 9: not understood"),
        ("a.ply", PLY[:100].encode(), "whose header does not end: it is cut short"),
        ("a.ply", PLY.replace("format ascii 1.0\n", "").encode(), "names no known format"),
        ("a.ply", PLY[:-40].encode(), "counts 6 face elements, the file ends within number 3"),
        ("a.ply", PLY[:-8].encode(), "face 5 (from 0) is '4 3', not the values that its header tells"),
        ("a.ply", PLY.replace("4 4 5 6 7", "4 4 nan 6 7").encode(), "a vertex number of a face is no whole number"),
        ("a.ply", PLY.replace("4 4 5 6 7", "4 4 5.5 6 7").encode(), "a vertex number of a face is no whole number"),
        ("a.ply", PLY.replace("property float z\n", "").encode(), "its vertices have no coordinate z"),
        ("a.ply", PLY.replace("vertex_indices", "corners").encode(), "have no list vertex_indices"),
        ("a.ply", ply_file(BLOCK_VERTICES, BLOCK_FACES, "binary_little_endian")[:-9], "ends within number 5"),
        ("a.vtp", b"<VTKFile type='PolyData'><PolyData>", "cannot be read as VTP"),
        ("a.vtp", b"<VTKFile type='UnstructuredGrid'/>", "it holds UnstructuredGrid"),
        ("a.vtp", b"<VTKFile type='PolyData' compressor='mine'/>", "compressed by mine; zlib, LZ4 and LZMA"),
        ("a.vtp", b"<VTKFile type='PolyData'/>", "0 faces"),
    ],
)  # fmt: skip
def test_a_message_names_what_was_found(tmp_path: Path, name: str, content: bytes, found: str) -> None:
    assert found in complaint(tmp_path, content, name)


@pytest.mark.parametrize("compressor", COMPRESSORS)
@pytest.mark.parametrize("kept", [0.0, 0.02, 0.1, 0.5, 0.9])
def test_a_compressed_file_that_is_cut_short_gives_one_line(
    tmp_path: Path, compressor: str, kept: float
) -> None:
    content = vtp_file(BLOCK_VERTICES, BLOCK_FACES, form="appended", compressor=compressor)
    start = content.index(b"_", content.index(b"<AppendedData")) + 1
    end = start + int(kept * (content.index(b"\n</AppendedData>") - start))
    assert "cannot be read as VTP" in complaint(tmp_path, content[:end], "cut.vtp")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no such file"):
        read_surface(tmp_path / "liver.stl")


def test_a_file_too_large_is_refused_before_it_is_read(tmp_path: Path) -> None:
    with (tmp_path / "huge.stl").open("wb") as stream:
        stream.truncate(600_000_000)
    with pytest.raises(InputError, match="600 MB, and at most"):
        read_surface(tmp_path / "huge.stl")


def test_a_file_that_changes_is_read_anew(tmp_path: Path) -> None:
    assert read(tmp_path, STL).volume_m3 == pytest.approx(BLOCK_VOLUME)
    assert read(tmp_path, stl_binary(block_surface(SIZE, (2, 2, 2)).corners * 2)).volume_m3 == pytest.approx(
        8 * BLOCK_VOLUME
    )


METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 0.0254}


@given(unit=st.sampled_from(UNITS), length=st.floats(0.003, 1.9))
def test_a_stated_unit_is_taken(tmp_path_factory: pytest.TempPathFactory, unit: str, length: float) -> None:
    file = tmp_path_factory.getbasetemp() / "stated.stl"
    file.write_bytes(stl_binary(CORNERS * (length / 0.1 / METRES[unit])))
    read = read_surface(file, unit)
    assert np.ptp(read.surface.vertices[:, 0]) == pytest.approx(length, rel=1e-6)
    assert read.repairs == ()
    assert np.ptp(surface_bounds(file, unit), axis=0)[0] == pytest.approx(length, rel=1e-6)


@given(length=st.floats(0.061, 1.9), away=st.floats(-5000.0, 5000.0))
def test_millimetres_are_told_from_the_size_wherever_the_surface_lies(
    tmp_path_factory: pytest.TempPathFactory, length: float, away: float
) -> None:
    file = tmp_path_factory.getbasetemp() / "millimetres.obj"
    file.write_text(obj_text((np.array(BLOCK_VERTICES) * (length / 0.1 * 1e3) + away).tolist(), BLOCK_FACES))
    read = read_surface(file)
    assert np.ptp(read.surface.vertices[:, 0]) == pytest.approx(length, rel=1e-6)
    assert read.surface.volume_m3 == pytest.approx(BLOCK_VOLUME * (length / 0.1) ** 3, rel=1e-6)
    assert len(read.repairs) == 1
    assert "taken as millimetres by its size" in read.repairs[0]


@pytest.mark.parametrize(
    ("length", "unit", "found"),
    [
        (12.0, None, "mm (0.012 m), cm (0.12 m), inch (0.305 m) would do"),
        (1e-3, None, "no unit of mm, cm, m, inch makes it one"),
        (1e6, None, "no unit of mm, cm, m, inch makes it one"),
        (120.0, "m", "120 m long, and phantoms are 0.002 to 2 m; state its unit: mm (0.12 m), cm (1.2 m)"),
        (0.12, "mm", "0.12 mm long, and phantoms are 0.002 to 2 m; state its unit: m (0.12 m), inch (0.00305 m)"),
    ],
)  # fmt: skip
def test_a_unit_that_cannot_be_told_or_does_not_fit_is_refused_with_those_that_do(
    tmp_path: Path, length: float, unit: str | None, found: str
) -> None:
    file = tmp_path / "block.stl"
    file.write_bytes(stl_binary(CORNERS * length / 0.1))
    with pytest.raises(InputError) as caught:
        read_surface(file, unit)
    assert found in str(caught.value)


@pytest.mark.parametrize("count", [0, 1, 6, 11, 13, 40, 2**32 - 1])
def test_a_wrong_count_of_a_whole_stl_file_is_told_and_all_is_read(count: int, tmp_path: Path) -> None:
    content = stl_binary(CORNERS, count=count)
    file = tmp_path / "a.stl"
    file.write_bytes(content)
    found = read_surface(file)
    assert found.surface.volume_m3 == pytest.approx(BLOCK_VOLUME, rel=1e-6)
    assert found.repairs[0].startswith(f"the header counts {count} triangles; the 12 for which")


@pytest.mark.parametrize("missing", [1, 2, 5])
def test_a_count_that_does_not_fit_an_open_surface_is_named_with_it(missing: int, tmp_path: Path) -> None:
    file = tmp_path / "a.stl"
    file.write_bytes(stl_binary(CORNERS[:-missing], count=12))
    with pytest.raises(
        InputError, match=rf"is open at .*; in the file the header counts 12 triangles; the {12 - missing}"
    ):
        read_surface(file)


@pytest.mark.parametrize("tail", [bytes(50), bytes(100), np.full(25, 9e9, "<f4").tobytes(), b"\xff" * 50])
def test_what_is_no_triangle_behind_the_last_one_is_left_out(tail: bytes, tmp_path: Path) -> None:
    file = tmp_path / "a.stl"
    file.write_bytes(STL + tail)
    found = read_surface(file)
    assert found.surface.volume_m3 == pytest.approx(BLOCK_VOLUME, rel=1e-6)
    assert found.repairs == (f"{len(tail)} bytes behind the last triangle were left out",)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("a.obj", lambda text: text.replace("\nf 1 4 3 2", "\nf 1 4 3 2 # below")),
        ("a.obj", lambda text: text.replace("\nv 0.05 0.04 0.005", "\nv 0.05 0.04 0.005 # corner 7")),
        ("a.obj", lambda text: text.replace("\nf ", "\nfo ")),
        ("a.obj", lambda text: f"{text}p 1 2\nl 1 2 3\n"),
        ("a.obj", lambda text: f"{text}v nan nan nan\nv 1e30 0 0\n"),
    ],
)
def test_obj_files_are_read_as_programs_write_them(
    name: str, change: Callable[[str], str], tmp_path: Path
) -> None:
    file = tmp_path / name
    file.write_text(change(OBJ))
    assert read_surface(file).surface.volume_m3 == pytest.approx(BLOCK_VOLUME, rel=1e-6)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("comment", ["comment before end_header of it", "obj_info end_header"])
def test_a_comment_of_a_ply_file_does_not_end_its_header(comment: str, form: str, tmp_path: Path) -> None:
    file = tmp_path / "a.ply"
    content = ply_file(BLOCK_VERTICES, BLOCK_FACES, form)
    file.write_bytes(content.replace(b"comment a block", comment.encode()))
    assert read_surface(file).surface.volume_m3 == pytest.approx(BLOCK_VOLUME, rel=1e-6)
