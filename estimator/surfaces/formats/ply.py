"""Polygons of a PLY file, text or binary of either byte order (G. Turk, "The PLY Polygon File Format", 1994)."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.surfaces.formats.ply_table import BinaryBody, Column, Element, Property, TextBody
from estimator.surfaces.formats.soup import PolygonSoup, joined, triangles_of_strip

_NUMPY_NAMES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
_INDEX_NAMES = ("vertex_indices", "vertex_index")
_STRIP_ENDS = -1
_LARGEST_NUMBER = 2.0**53

IntArray = NDArray[np.int64]


def read_ply(content: bytes, file: Path) -> PolygonSoup:
    """Return the faces and triangle strips of the file, in its unit; ``file`` is named.

    Raises
    ------
    InputError
        The header is none, an element has other columns than it should, or the file is cut short.
    """
    vertices = np.empty((0, 3))
    parts: list[tuple[IntArray, IntArray]] = []
    for element, table in ply_tables(content, file):
        if element.name == "vertex":
            vertices = vertices_of(table, file)
        elif element.name == "face":
            parts.append(_polygons(table, element, file))
        elif element.name == "tristrips":
            parts.append(_strips(table, element, file))
    return PolygonSoup(vertices, *joined(parts))


def vertices_of(table: Mapping[str, Column], file: Path) -> NDArray[np.float64]:
    """Return the places (n, 3) of the rows of a table, in the file's unit."""
    return np.stack([_scalars(table, axis, file) for axis in "xyz"], axis=1)


def ply_tables(content: bytes, file: Path) -> Iterator[tuple[Element, Mapping[str, Column]]]:
    """Yield the elements of a file with their columns, in the order of the file, which is named.

    Raises
    ------
    InputError
        The header is none, or the file is cut short.
    """
    head, separator, rest = content.partition(b"\nend_header")
    if not separator:
        head, separator, rest = content.partition(b"\rend_header")
    lines = head.decode("ascii", errors="replace").splitlines()
    if not separator or not lines or lines[0].strip() != "ply":
        raise InputError(
            f"{file}: begins as a PLY file, whose header does not end: it is cut short; export it again"
        )
    form, elements = _header(file, lines)
    body = _behind_line_end(rest, head)
    rows = (
        TextBody(body, file)
        if form == "ascii"
        else BinaryBody(body, np.dtype(_BYTE_ORDERS[form] + "i4"), file)
    )
    for element in elements:
        yield element, rows.table(element)


def _behind_line_end(rest: bytes, head: bytes) -> bytes:
    """Return what follows the header; its line ends tell whether a line feed behind a return belongs to it."""
    if rest.startswith(b"\r\n") and b"\r\n" in head:
        return rest[2:]
    return rest[1:] if rest[:1] in (b"\n", b"\r") else rest.partition(b"\n")[2]


def _header(file: Path, lines: list[str]) -> tuple[str, list[Element]]:
    form, elements = "", list[Element]()
    for number, line in enumerate(lines[1:], start=2):
        try:
            match line.split():
                case ["format", ("ascii" | "binary_little_endian" | "binary_big_endian") as form, _]:
                    pass
                case ["element", name, count] if int(count) >= 0:
                    elements.append(Element(name, int(count)))
                case ["property", "list", count_type, value_type, name]:
                    found = Property(name, _NUMPY_NAMES[value_type], _NUMPY_NAMES[count_type])
                    elements[-1].properties.append(found)
                case ["property", value_type, name]:
                    elements[-1].properties.append(Property(name, _NUMPY_NAMES[value_type]))
                case ["comment" | "obj_info", *_] | []:
                    pass
                case _:
                    raise ValueError
        except (ValueError, KeyError, IndexError):
            raise InputError(
                f"{file}, line {number}: not understood: {line[:60]!r}; export the surface again"
            ) from None
    if not form:
        raise InputError(f"{file}: its header names no known format; export the surface again")
    if empty := [element.name for element in elements if element.count and not element.properties]:
        raise InputError(f"{file}: its header gives {empty[0]} no property; export the surface again")
    return form, elements


def _scalars(table: Mapping[str, Column], name: str, file: Path) -> NDArray[np.float64]:
    if name not in table or table[name].is_list:
        raise InputError(f"{file}: its vertices have no coordinate {name}; export the surface again")
    return table[name].values


def _polygons(table: Mapping[str, Column], element: Element, file: Path) -> tuple[IntArray, IntArray]:
    name = next((name for name in _INDEX_NAMES if name in table and table[name].is_list), None)
    if name is None:
        raise InputError(
            f"{file}: its {element.name} elements have no list vertex_indices; export the surface again"
        )
    column = table[name]
    if not np.all(np.abs(column.values) < _LARGEST_NUMBER) or np.any(column.values % 1):
        raise InputError(f"{file}: a vertex number of a face is no whole number; export the surface again")
    return column.values.astype(np.int64), column.ends


def _strips(table: Mapping[str, Column], element: Element, file: Path) -> tuple[IntArray, IntArray]:
    """Return the triangles of strips, which -1 parts."""
    nodes, ends = _polygons(table, element, file)
    cuts = np.union1d(ends, np.flatnonzero(nodes == _STRIP_ENDS))
    strips = [part[part != _STRIP_ENDS] for part in np.split(nodes, cuts)]
    triangles = np.concatenate([np.empty((0, 3), np.int64), *map(triangles_of_strip, strips)])
    return triangles.reshape(-1), np.arange(3, triangles.size + 1, 3, dtype=np.int64)
