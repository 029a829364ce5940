"""Polygons and triangle strips of a VTK XML PolyData file; its verts, lines and data are left out."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.surfaces.formats.soup import PolygonSoup, joined, triangles_of_strip
from estimator.surfaces.formats.vtk_arrays import DAMAGED, VtkXml

IntArray = NDArray[np.int64]


def read_vtp(content: bytes, file: Path) -> PolygonSoup:
    """Return the polygons of all pieces, in the file's unit; ``file`` is named.

    Raises
    ------
    InputError
        The file is of another kind, damaged, or compressed by an unknown method.
    """
    try:
        document = VtkXml(content)
        if document.root.attrib["type"] != "PolyData":
            raise ValueError(f"it holds {document.root.attrib['type'][:40]}")
        return _polygons(document)
    except DAMAGED as error:
        raise InputError(
            f"{file}: cannot be read as VTP ({error}); save it again as PolyData, for instance as text"
        ) from None


def _polygons(document: VtkXml) -> PolygonSoup:
    vertices, count = [np.empty((0, 3))], 0
    parts: list[tuple[IntArray, IntArray]] = []
    for piece in document.root.findall("./PolyData/Piece"):
        points = document.values(piece.find("./Points/DataArray")).astype(np.float64).reshape(-1, 3)
        if int(piece.get("NumberOfPolys", "0")):
            nodes, ends = _cells(document, piece, "Polys")
            parts.append((nodes + count, ends))
        if int(piece.get("NumberOfStrips", "0")):
            nodes, ends = _cells(document, piece, "Strips")
            strips = [triangles_of_strip(strip) for strip in np.split(nodes, ends[:-1])]
            triangles = np.concatenate(strips) + count
            parts.append((triangles.reshape(-1), np.arange(3, triangles.size + 1, 3, dtype=np.int64)))
        vertices.append(points)
        count += len(points)
    return PolygonSoup(np.concatenate(vertices), *joined(parts))


def _cells(document: VtkXml, piece: ElementTree.Element, kind: str) -> tuple[IntArray, IntArray]:
    nodes = document.values(piece.find(f"./{kind}/DataArray[@Name='connectivity']")).astype(np.int64)
    ends = document.values(piece.find(f"./{kind}/DataArray[@Name='offsets']")).astype(np.int64)
    if not len(ends) or ends[-1] != len(nodes) or np.any(np.diff(ends, prepend=0) < 0):
        raise ValueError(f"the offsets of its {kind} do not fit their connectivity")
    return nodes, ends
