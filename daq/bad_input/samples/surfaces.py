"""Files of surfaces as most programs write them."""

from pathlib import Path

from estimator.geometry.shapes import sphere_surface
from estimator.surfaces.surface import Surface
from estimator.surfaces.writing import write_ply, write_stl


def stl(folder: Path) -> None:
    """Write a binary STL file."""
    write_stl(_body(), folder / "body.stl")


def stl_text(folder: Path) -> None:
    """Write an STL file of text."""
    facets = [
        f"facet normal 0 0 0\n outer loop\n{corners}\n endloop\nendfacet"
        for triangle in _body().corners.tolist()
        for corners in ["\n".join(f"  vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in triangle)]
    ]
    (folder / "body.stl").write_text("\n".join(["solid body", *facets, "endsolid body\n"]), encoding="utf-8")


def ply(folder: Path) -> None:
    """Write a binary PLY file."""
    write_ply(_body(), folder / "body.ply")


def ply_text(folder: Path) -> None:
    """Write a PLY file of text."""
    body = _body()
    lines = [
        "ply\nformat ascii 1.0",
        f"element vertex {len(body.vertices)}\nproperty double x\nproperty double y\nproperty double z",
        f"element face {len(body.triangles)}\nproperty list uchar int vertex_indices\nend_header",
        *(" ".join(map(repr, vertex)) for vertex in body.vertices.tolist()),
        *(f"3 {a} {b} {c}" for a, b, c in body.triangles.tolist()),
    ]
    (folder / "body.ply").write_text("\n".join([*lines, ""]), encoding="utf-8")


def obj(folder: Path) -> None:
    """Write an OBJ file."""
    body = _body()
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in body.vertices.tolist()]
    lines += [f"f {a + 1}/1/1 {b + 1}/1/1 {c + 1}/1/1" for a, b, c in body.triangles.tolist()]
    (folder / "body.obj").write_text("\n".join([*lines, ""]), encoding="utf-8")


def vtp(folder: Path) -> None:
    """Write a VTP file of text."""
    body = _body()
    points = " ".join(map(repr, body.vertices.ravel().tolist()))
    nodes = " ".join(map(str, body.triangles.ravel().tolist()))
    ends = " ".join(str(3 * (number + 1)) for number in range(len(body.triangles)))
    (folder / "body.vtp").write_text(
        '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" '
        f'header_type="UInt32">\n<PolyData>\n<Piece NumberOfPoints="{len(body.vertices)}" '
        f'NumberOfPolys="{len(body.triangles)}">\n<Points>\n<DataArray type="Float64" NumberOfComponents="3" '
        f'format="ascii">{points}</DataArray>\n</Points>\n<Polys>\n<DataArray type="Int64" Name="connectivity" '
        f'format="ascii">{nodes}</DataArray>\n<DataArray type="Int64" Name="offsets" format="ascii">{ends}'
        "</DataArray>\n</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n",
        encoding="utf-8",
    )


def _body() -> Surface:
    return sphere_surface(0.03, 1)
