"""Writes surfaces in every format that is read, as their descriptions have it and as other programs do."""

import base64
import lzma
import struct
import zlib
from collections.abc import Callable, Sequence
from itertools import pairwise

import lz4.block
import numpy as np
from numpy.typing import NDArray

from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

BLOCK_VERTICES = [
    (x, y, z)
    for z in (-0.005, 0.005)
    for x, y in ((-0.05, -0.04), (0.05, -0.04), (0.05, 0.04), (-0.05, 0.04))
]
"""Corners of a block of 100 x 80 x 10 mm."""
BLOCK_FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
BLOCK_VOLUME = 8e-5

COMPRESSORS: dict[str, Callable[[bytes], bytes]] = {
    "vtkZLibDataCompressor": zlib.compress,
    "vtkLZ4DataCompressor": lambda block: lz4.block.compress(block, store_size=False),
    "vtkLZMADataCompressor": lzma.compress,
}


def stl_text(corners: FloatArray) -> str:
    facets = (
        "  facet normal 0 0 0\n    outer loop\n"
        + "".join(f"      vertex {x!r} {y!r} {z!r}\n" for x, y, z in triangle)
        + "    endloop\n  endfacet\n"
        for triangle in corners.tolist()
    )
    return f"solid block\n{''.join(facets)}endsolid block\n"


def stl_binary(corners: FloatArray, header: bytes = b"a block", count: int | None = None) -> bytes:
    rows = np.zeros(
        len(corners), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    )
    rows["corners"] = corners
    told = len(corners) if count is None else count
    return header.ljust(80)[:80] + struct.pack("<I", told) + rows.tobytes()


def obj_text(vertices: Sequence[Sequence[float]], faces: Sequence[Sequence[int]]) -> str:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(node + 1) for node in face) for face in faces]
    return "# a block\n" + "\n".join(lines) + "\n"


def ply_file(
    vertices: Sequence[Sequence[float]], faces: Sequence[Sequence[int]], form: str = "ascii"
) -> bytes:
    header = (
        f"ply\nformat {form} 1.0\ncomment a block\nelement vertex {len(vertices)}\nproperty float nx\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nproperty uchar red\nend_header\n"
    ).encode()
    if form == "ascii":
        rows = [" ".join(map(str, [0, *vertex])) for vertex in vertices]
        rows += [" ".join(map(str, [len(face), *face, 7])) for face in faces]
        return header + "\n".join([*rows, ""]).encode()
    order = {"binary_little_endian": "<", "binary_big_endian": ">"}[form]
    body = b"".join(struct.pack(f"{order}4f", 0.0, *vertex) for vertex in vertices)
    body += b"".join(struct.pack(f"{order}B{len(face)}iB", len(face), *face, 7) for face in faces)
    return header + body


def vtp_file(
    vertices: Sequence[Sequence[float]],
    polygons: Sequence[Sequence[int]],
    strips: Sequence[Sequence[int]] = (),
    form: str = "ascii",
    encoding: str = "raw",
    compressor: str | None = None,
    order: str = "LittleEndian",
    header: str = "UInt32",
) -> bytes:
    """A VTP file whose arrays are written as ``form`` says, appended ones in ``encoding``, in blocks of 64 bytes."""
    appendix = b""

    def array(name: str, values: NDArray[np.generic], columns: int = 1) -> str:
        nonlocal appendix
        kind = {"f": "Float32", "i": "Int64"}[values.dtype.kind]
        begin = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{columns}" format="{form}"'
        if form == "ascii":
            return f"{begin}>\n{' '.join(map(str, values.ravel().tolist()))}\n</DataArray>"
        content = values.astype(values.dtype.newbyteorder(">" if order == "BigEndian" else "<")).tobytes()
        parts = _packed(content, compressor, order, header)
        if form == "binary":
            return f"{begin}>\n{b''.join(base64.b64encode(part) for part in parts).decode()}\n</DataArray>"
        start = len(appendix)
        appendix += b"".join(base64.b64encode(part) if encoding == "base64" else part for part in parts)
        return f'{begin} offset="{start}"/>'

    def cells(kind: str, rows: Sequence[Sequence[int]]) -> str:
        nodes = np.array([node for row in rows for node in row], dtype=np.int64)
        ends = np.cumsum([len(row) for row in rows], dtype=np.int64)
        return f"<{kind}>{array('connectivity', nodes)}{array('offsets', ends)}</{kind}>"

    points = array("Points", np.array(vertices, dtype=np.float32), 3)
    body = (
        f'<PolyData><Piece NumberOfPoints="{len(vertices)}" NumberOfPolys="{len(polygons)}" '
        f'NumberOfStrips="{len(strips)}"><Points>{points}</Points>{cells("Strips", strips)}'
        f"{cells('Polys', polygons)}</Piece></PolyData>"
    )
    packed = f' compressor="{compressor}"' if compressor else ""
    head = f'<VTKFile type="PolyData" version="1.0" byte_order="{order}" header_type="{header}"{packed}>'
    tail = f'<AppendedData encoding="{encoding}">\n_'.encode() + appendix + b"\n</AppendedData>"
    return f'<?xml version="1.0"?>\n{head}{body}'.encode() + (tail if appendix else b"") + b"</VTKFile>\n"


def _packed(content: bytes, compressor: str | None, order: str, header: str) -> list[bytes]:
    """Sizes and content, which are encoded one after the other."""
    letter = (">" if order == "BigEndian" else "<") + {"UInt32": "I", "UInt64": "Q"}[header]

    def words(*values: int) -> bytes:
        return b"".join(struct.pack(letter, value) for value in values)

    if compressor is None:
        return [words(len(content)) + content]
    cuts = [*range(0, len(content), 64), len(content)]
    blocks = [COMPRESSORS[compressor](content[a:b]) for a, b in pairwise(cuts)]
    sizes = words(len(blocks), 64, len(content) % 64, *map(len, blocks))
    return [sizes, b"".join(blocks)]


def faces_of(surface: Surface) -> tuple[list[list[float]], list[list[int]]]:
    return surface.vertices.tolist(), surface.triangles.tolist()
