"""Valid files of surfaces in the ways that only some programs write: packed arrays, strips, another unit."""

import lzma
import struct
from dataclasses import replace
from pathlib import Path

import lz4.block
import numpy as np
from numpy.typing import NDArray

from daq.bad_input.samples.experiments import experiment_of_surface
from daq.virtual_rig.layout import SPECIMEN
from estimator.geometry.shapes import block_surface, sphere_surface
from estimator.surfaces.writing import write_ply

_BODY = sphere_surface(0.05, 1)


def vtp_packed(folder: Path) -> None:
    """Write a VTP file, big endian, whose arrays are appended as they are, by LZ4."""
    content = b"".join(
        struct.pack(">4Q", 1, len(raw), 0, len(packed)) + packed
        for raw, packed in ((raw, lz4.block.compress(raw, store_size=False)) for raw in _arrays(">"))
    )
    _write_vtp(folder, content, "BigEndian", "UInt64", "vtkLZ4DataCompressor")


def vtp_lzma(folder: Path) -> None:
    """Write a VTP file whose arrays are appended as they are, by LZMA."""
    content = b"".join(
        struct.pack("<4I", 1, len(raw), 0, len(packed)) + packed
        for raw, packed in ((raw, lzma.compress(raw)) for raw in _arrays("<"))
    )
    _write_vtp(folder, content, "LittleEndian", "UInt32", "vtkLZMADataCompressor")


def ply_of_strips(folder: Path) -> None:
    """Write a binary PLY file of triangle strips, each of one triangle."""
    strips = np.column_stack([_BODY.triangles, np.full(len(_BODY.triangles), -1)])
    header = (
        f"ply\nformat binary_big_endian 1.0\nelement vertex {len(_BODY.vertices)}\nproperty double x\n"
        "property double y\nproperty double z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    )
    body = _BODY.vertices.astype(">f8").tobytes() + struct.pack(">i", strips.size)
    (folder / "body.ply").write_bytes(header.encode() + body + strips.astype(">i4").tobytes())


def experiment_of_ply(folder: Path) -> None:
    """Write one experiment, ``pull``, of a body given as a PLY file in millimetres."""
    experiment_of_surface(folder)
    block = block_surface(SPECIMEN.phantom.size_m, (3, 3, 1))
    write_ply(replace(block, vertices=1e3 * block.vertices), folder / "pull" / "body.ply")
    stated = folder / "pull" / "experiment.toml"
    text = stated.read_text(encoding="utf-8")
    named = text.replace('surface = "phantom.stl"', 'surface = "body.ply"\nunit = "mm"')
    stated.write_text(named, encoding="utf-8")
    (folder / "pull" / "phantom.stl").unlink()


def _arrays(order: str) -> list[bytes]:
    """Return the bytes of points, vertex numbers and ends."""
    ends = np.arange(3, _BODY.triangles.size + 1, 3)
    arrays: list[tuple[NDArray[np.generic], str]] = [
        (_BODY.vertices, "f8"),
        (_BODY.triangles, "i8"),
        (ends, "i8"),
    ]
    return [values.astype(order + kind).tobytes() for values, kind in arrays]


def _write_vtp(folder: Path, content: bytes, order: str, header: str, compressor: str) -> None:
    word = {"UInt32": 4, "UInt64": 8}[header]
    letter = (">" if order == "BigEndian" else "<") + {4: "I", 8: "Q"}[word]
    starts, place = [], 0
    for _ in range(3):
        starts.append(place)
        (packed,) = struct.unpack_from(letter, content, place + 3 * word)
        place += 4 * word + packed
    points, nodes, ends = (f'format="appended" offset="{start}"/>' for start in starts)
    text = (
        f'<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="{order}" '
        f'header_type="{header}" compressor="{compressor}">\n<PolyData>\n'
        f'<Piece NumberOfPoints="{len(_BODY.vertices)}" NumberOfPolys="{len(_BODY.triangles)}">\n'
        f'<Points><DataArray type="Float64" NumberOfComponents="3" {points}</Points>\n'
        f'<Polys><DataArray type="Int64" Name="connectivity" {nodes}<DataArray type="Int64" Name="offsets" {ends}'
        '</Polys>\n</Piece>\n</PolyData>\n<AppendedData encoding="raw">\n_'
    )
    tail = b"\n</AppendedData>\n</VTKFile>\n"
    (folder / "body.vtp").write_bytes(text.encode() + content + tail)
