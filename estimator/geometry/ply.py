"""Polygons of a PLY file, text or binary of either byte order (G. Turk, "The PLY Polygon File Format", 1994)."""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from estimator.errors import InputError

_LETTERS = {
    **dict.fromkeys(("char", "int8"), "b"),
    **dict.fromkeys(("uchar", "uint8"), "B"),
    **dict.fromkeys(("short", "int16"), "h"),
    **dict.fromkeys(("ushort", "uint16"), "H"),
    **dict.fromkeys(("int", "int32"), "i"),
    **dict.fromkeys(("uint", "uint32"), "I"),
    **dict.fromkeys(("float", "float32"), "f"),
    **dict.fromkeys(("double", "float64"), "d"),
}
_BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
_INDEX_NAMES = ("vertex_indices", "vertex_index")

Row = list[Sequence[float]]


@dataclass(frozen=True, slots=True)
class _Property:
    """A column of an element: one value, or as many as a count before them tells; types as ``struct`` letters."""

    name: str
    letter: str
    count_letter: str = ""


@dataclass(frozen=True, slots=True)
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)


def read_ply(content: bytes, file: Path) -> tuple[list[Sequence[float]], list[Sequence[int]]]:
    """Return vertices (x, y, z), in the file's unit, and polygons as vertex numbers from 0; ``file`` is named.

    Raises
    ------
    InputError
        The file is no PLY file, or cut short; the message names the line of the header or the row.
    """
    head, separator, body = content.partition(b"end_header")
    body = body.partition(b"\n")[2]
    lines = head.decode("ascii", errors="replace").splitlines()
    if not separator or not lines or lines[0].strip() != "ply":
        raise InputError(f"{file}: no PLY file (it has no header); export the surface again")
    form, elements = _header(file, lines)
    vertices: list[Sequence[float]] = []
    polygons: list[Sequence[int]] = []
    rows = _text_rows(body, elements) if form == "ascii" else _binary_rows(body, elements, _BYTE_ORDERS[form])
    for element in elements:
        columns = {prop.name: number for number, prop in enumerate(element.properties)}
        for number in range(element.count):
            try:
                row = next(rows)
                if element.name == "vertex":
                    vertices.append([row[columns[axis]][0] for axis in "xyz"])
                elif element.name == "face":
                    name = next(name for name in _INDEX_NAMES if name in columns)
                    polygons.append([int(index) for index in row[columns[name]]])
            except (StopIteration, KeyError, IndexError, ValueError, OverflowError, struct.error):
                raise InputError(
                    f"{file}: {element.name} {number} (from 0) cannot be read; the file is cut short or has other "
                    "columns than x, y, z and vertex_indices: export the surface again"
                ) from None
    return vertices, polygons


def _header(file: Path, lines: list[str]) -> tuple[str, list[_Element]]:
    form, elements = "", list[_Element]()
    for number, line in enumerate(lines[1:], start=2):
        try:
            match line.split():
                case ["format", ("ascii" | "binary_little_endian" | "binary_big_endian") as form, _]:
                    pass
                case ["element", name, count]:
                    elements.append(_Element(name, int(count)))
                case ["property", "list", count_type, value_type, name]:
                    elements[-1].properties.append(
                        _Property(name, _LETTERS[value_type], _LETTERS[count_type])
                    )
                case ["property", value_type, name]:
                    elements[-1].properties.append(_Property(name, _LETTERS[value_type]))
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
    return form, elements


def _text_rows(body: bytes, elements: list[_Element]) -> Iterator[Row]:
    lines = iter(body.decode("ascii", errors="replace").splitlines())
    for element in elements:
        for _ in range(element.count):
            values = [float(word) for word in next(lines, "").split()]
            row: Row = []
            start = 0
            for prop in element.properties:
                length = 1
                if prop.count_letter:
                    length, start = int(values[start]), start + 1
                row.append(values[start : start + length])
                start += length
            yield row


def _binary_rows(body: bytes, elements: list[_Element], order: str) -> Iterator[Row]:
    offset = 0
    for element in elements:
        for _ in range(element.count):
            row: Row = []
            for prop in element.properties:
                length = 1
                if prop.count_letter:
                    (length,) = struct.unpack_from(order + prop.count_letter, body, offset)
                    offset += struct.calcsize(prop.count_letter)
                row.append(struct.unpack_from(f"{order}{length}{prop.letter}", body, offset))
                offset += length * struct.calcsize(prop.letter)
            yield row
