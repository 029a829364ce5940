"""Surfaces with a number at every corner or face, as programs paint regions: PLY, VTP and VTU."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from estimator.errors import InputError
from estimator.input_file import read_input, require_file
from estimator.surfaces.formats.ply import ply_tables, vertices_of
from estimator.surfaces.formats.recognition import MOST_SURFACE_BYTES
from estimator.surfaces.formats.vtk_arrays import DAMAGED, VtkXml
from estimator.surfaces.units import METRES, Unit, unit_of

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_FILES = 8
# Numbers that differ by less than this share are one: single precision.
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Painting:
    """Where a surface has which number.

    Attributes
    ----------
    points : (n, 3) float64, corners or centres of faces, m
    values : (n,) float64
    """

    points: FloatArray
    values: FloatArray

    def has(self, value: float) -> BoolArray:
        """Tell which of the points (n,) have a value."""
        return np.abs(self.values - value) <= _SAME * max(1.0, abs(value))

    def nearest_has(self, value: float, positions: FloatArray) -> BoolArray:
        """Tell for positions (m, 3), m, whether the nearest point of the painting has a value."""
        _, nearest = cKDTree(self.points).query(positions)
        return self.has(value)[nearest]


def read_painting(file: Path | str, scalar: str, unit: Unit | None = None) -> Painting:
    """Read the numbers of a name on a surface; as long as the file stays as it is, it is read once.

    Parameters
    ----------
    file : PLY with a property of that name of its vertices or faces; VTP or VTU with a point or cell array
    scalar : name of the property or array
    unit : of the file's lengths; None for metres, or millimetres where only these give a phantom

    Raises
    ------
    InputError
        The file is missing or damaged, or has no such numbers; the message names those that there are.
    """
    path = Path(file)
    require_file(path)
    found = path.stat()
    return _read(path, scalar, unit, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=_FILES)
def _read(path: Path, scalar: str, unit: Unit | None, _modified_ns: int, _size: int) -> Painting:
    content = read_input(path, MOST_SURFACE_BYTES)
    of_vtk = content.lstrip().startswith(b"<")
    try:
        points, values, names = (_of_vtk if of_vtk else _of_ply)(content, path, scalar)
    except DAMAGED as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: cannot be read as PLY, VTP or VTU ({error}); save it again") from None
    if values is None:
        raise InputError(
            f"{path}: has no single number {scalar!r} at its corners or faces; it has {', '.join(names) or 'none'}"
        )
    if not len(points) or not np.isfinite(points).all():
        raise InputError(f"{path}: has no corner, or one at no finite place; save it again")
    which, _ = unit_of(float(np.ptp(points, axis=0).max()), unit, str(path))
    return Painting(points * METRES[which], values)


_Found = tuple[FloatArray, FloatArray | None, list[str]]


def _of_ply(content: bytes, path: Path, scalar: str) -> _Found:
    vertices, names = np.empty((0, 3)), list[str]()
    found: tuple[FloatArray, FloatArray] | None = None
    for element, table in ply_tables(content, path):
        names += [
            name for name, column in table.items() if not column.is_list and name not in ("x", "y", "z")
        ]
        if element.name == "vertex":
            vertices = vertices_of(table, path)
        has_it = scalar in table and not table[scalar].is_list
        if element.name == "vertex" and has_it:
            found = vertices, table[scalar].values
        elif element.name == "face" and has_it and found is None:
            (corners,) = (column for name, column in table.items() if name.startswith("vertex_ind"))
            ends = corners.ends.tolist()
            found = _centres(vertices, corners.values.astype(np.int64), ends), table[scalar].values
    return (*found, names) if found is not None else (vertices, None, names)


def _of_vtk(content: bytes, path: Path, scalar: str) -> _Found:
    document, names = VtkXml(content), list[str]()
    points, values = list[FloatArray](), list[FloatArray]()
    for piece in document.root.iter("Piece"):
        corners = document.values(piece.find("./Points/DataArray")).astype(np.float64).reshape(-1, 3)
        for where in ("PointData", "CellData"):
            arrays = piece.findall(f"./{where}/DataArray")
            names += [name for array in arrays if (name := array.get("Name", "")) not in names]
            chosen = [array for array in arrays if array.get("Name") == scalar]
            if not chosen:
                continue
            points.append(corners if where == "PointData" else _centres_of_cells(document, piece, corners))
            values.append(document.values(chosen[0]).astype(np.float64))
            if len(values[-1]) != len(points[-1]):
                return corners, None, names
            break
    if not values:
        return np.empty((0, 3)), None, names
    return np.concatenate(points), np.concatenate(values), names


def _centres_of_cells(document: VtkXml, piece: ElementTree.Element, corners: FloatArray) -> FloatArray:
    cells = piece.find("./Cells")
    cells = piece.find("./Polys") if cells is None else cells
    if cells is None:
        raise ValueError("it has no cells")
    nodes = document.values(cells.find("./DataArray[@Name='connectivity']")).astype(np.int64)
    ends = document.values(cells.find("./DataArray[@Name='offsets']")).astype(np.int64)
    return _centres(corners, nodes, ends.tolist())


def _centres(corners: FloatArray, nodes: NDArray[np.int64], ends: list[int]) -> FloatArray:
    return np.array([corners[nodes[a:b]].mean(axis=0) for a, b in pairwise([0, *ends])]).reshape(-1, 3)
