"""Meshes in MSH 4.1, text or binary ("Gmsh reference manual", section "MSH file format").

meshio refuses a file in which an element is in no group beside others that are in one.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.input_file import read_input
from estimator.meshes.volume_mesh import CellKind, FoundMesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_MOST_BYTES = 2_000_000_000
_KINDS: Mapping[int, CellKind] = {4: "tet4", 5: "hex8", 6: "wedge6", 7: "pyramid5", 11: "tet10"}
# Nodes of points, lines and faces; volume elements of other kinds are refused.
_OF_LESS_DIMENSIONS = {
    1: 2,
    2: 3,
    3: 4,
    8: 3,
    9: 6,
    10: 9,
    15: 1,
    16: 8,
    20: 9,
    21: 10,
    26: 4,
    27: 5,
    28: 6,
    36: 16,
    37: 25,
}
_NODES = {4: 4, 5: 8, 6: 6, 7: 5, 11: 10}
# Gmsh has the last two middle nodes of a tet10 the other way round.
_ORDER: Mapping[int, list[int]] = {11: [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]}

_Physical = Mapping[tuple[int, int], list[int]]


def read_msh41(file: Path) -> FoundMesh:
    """Return the volume elements of a file, with its groups as regions, and those of faces as sets of their nodes.

    Raises
    ------
    InputError
        The file is damaged, of another version, or has volume elements of kinds that are not read.
    """
    try:
        return _found(_Sections(read_input(file, _MOST_BYTES)), file)
    except (ValueError, KeyError, IndexError, OverflowError, UnicodeDecodeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{file}: cannot be read as MSH ({error}); save the mesh again") from None


class _Cursor:
    """Numbers of a section one after the other, as text or as bytes."""

    def __init__(self, content: bytes, start: int, order: Literal["", "<", ">"]) -> None:
        self._content, self.at, self._order = content, start, order
        end = content.find(b"\n$End", start)
        self._words = content[start:end].split() if not order else []
        self._next = 0
        if end < 0 and not order:
            raise ValueError("a section is cut short")

    def numbers(self, count: int) -> FloatArray:
        """Return so many floating-point numbers."""
        return np.asarray(self._values(np.dtype("f8"), count), dtype=np.float64)

    def integers(self, count: int) -> list[int]:
        """Return so many integers of four bytes."""
        return self._values(np.dtype("i4"), count).astype(np.int64).tolist()

    def sizes(self, count: int) -> IntArray:
        """Return so many integers of eight bytes."""
        return np.asarray(self._values(np.dtype("i8"), count), dtype=np.int64)

    def _values(self, kind: np.dtype[Any], count: int) -> NDArray[Any]:
        if not 0 <= count <= len(self._content):
            raise ValueError(f"a count of {count}")
        if self._order:
            end = self.at + count * kind.itemsize
            values = np.frombuffer(self._content[self.at : end], kind.newbyteorder(self._order))
            self.at = end
        else:
            words = self._words[self._next : self._next + count]
            values = np.array(words, dtype=np.bytes_).astype(kind) if words else np.zeros(0, kind)
            self._next += count
        if len(values) != count:
            raise ValueError("a section is cut short")
        return values


class _Sections:
    """Where each section of a file begins, behind its heading."""

    def __init__(self, content: bytes) -> None:
        heading = re.match(
            rb"\s*(?:\$Comments.*?\$EndComments\s*)?\$MeshFormat\s+(\S+)\s+([01])\s+(\d+)\s*?\n",
            content,
            re.DOTALL,
        )
        if not heading or heading[1] != b"4.1" or heading[3] != b"8":
            raise ValueError("its heading is not that of MSH 4.1")
        self._content = content
        self._order: Literal["", "<", ">"] = ""
        if heading[2] == b"1":
            self._order = "<" if content[heading.end() : heading.end() + 4] == b"\1\0\0\0" else ">"
        self._from = heading.end()

    def cursor(self, name: str) -> _Cursor | None:
        """Return the numbers of a section; None where the file has none of that name."""
        heading = re.compile(rb"^\$%b\r?\n" % name.encode(), re.MULTILINE).search(self._content, self._from)
        return None if heading is None else _Cursor(self._content, heading.end(), self._order)

    def names(self) -> dict[tuple[int, int], str]:
        """Return the names of groups by dimension and number."""
        found = re.search(
            rb"^\$PhysicalNames\r?\n(.*?)\$EndPhysicalNames", self._content, re.MULTILINE | re.DOTALL
        )
        rows = re.findall(rb'^\s*(\d+)\s+(-?\d+)\s+"(.*)"', found[1], re.MULTILINE) if found else []
        return {(int(dim), int(tag)): name.decode("utf-8") for dim, tag, name in rows}


def _found(sections: _Sections, file: Path) -> FoundMesh:
    if sections.cursor("PartitionedEntities") is not None:
        raise InputError(f"{file}: is partitioned; save the mesh in one part")
    physical = _physical(sections.cursor("Entities"))
    points, row_of = _points(sections)
    names = sections.names()
    blocks = dict[CellKind, list[IntArray]]()
    inside = dict[str, dict[CellKind, list[BoolArray]]]()
    node_sets, left_out = dict[str, BoolArray](), 0
    for dimension, entity, element_type, cells in _elements(sections, file):
        groups = [
            names.get((dimension, tag), f"group {tag}") for tag in physical.get((dimension, entity), [])
        ]
        nodes = row_of[np.minimum(cells, len(row_of) - 1)]
        if element_type not in _KINDS:
            left_out += len(cells)
            for name in groups:
                node_sets.setdefault(name, np.zeros(len(points), dtype=bool))[nodes[nodes >= 0]] = True
            continue
        kind = _KINDS[element_type]
        before = sum(map(len, blocks.setdefault(kind, [])))
        blocks[kind].append(nodes[:, _ORDER.get(element_type, slice(None))])
        for name in groups:
            held = inside.setdefault(name, {}).setdefault(kind, [])
            held += [np.zeros(before - sum(map(len, held)), dtype=bool), np.ones(len(cells), dtype=bool)]
    whole = {kind: np.concatenate(parts) for kind, parts in blocks.items()}
    regions = {
        name: {
            kind: np.pad(one := np.concatenate(parts), (0, len(whole[kind]) - len(one)))
            for kind, parts in held.items()
        }
        for name, held in inside.items()
    }
    remarks = (f"left out {left_out} elements of points, lines and faces",) if left_out else ()
    return FoundMesh(
        points, whole, regions, {n: s for n, s in node_sets.items() if n not in regions}, remarks
    )


def _physical(cursor: _Cursor | None) -> _Physical:
    """Return the groups of each entity, by its dimension and number."""
    found = dict[tuple[int, int], list[int]]()
    if cursor is None:
        return found
    for dimension, count in enumerate(cursor.sizes(4).tolist()):
        for _ in range(count):
            (tag,) = cursor.integers(1)
            cursor.numbers(6 if dimension else 3)
            (groups,) = cursor.sizes(1).tolist()
            found[dimension, tag] = [abs(group) for group in cursor.integers(groups)]
            if dimension:
                (bounding,) = cursor.sizes(1).tolist()
                cursor.integers(bounding)
    return found


def _points(sections: _Sections) -> tuple[FloatArray, IntArray]:
    """Return the places (n, 3) of nodes, and the row of each number; -1, the last one too, where there is none."""
    cursor = sections.cursor("Nodes")
    if cursor is None:
        raise ValueError("it has no nodes")
    blocks, count, _, _ = cursor.sizes(4).tolist()
    tags, points = list[IntArray](), list[FloatArray]()
    for _ in range(blocks):
        dimension, _, parametric = cursor.integers(3)
        (held,) = cursor.sizes(1).tolist()
        tags.append(cursor.sizes(held))
        width = 3 + (dimension if parametric else 0)
        points.append(cursor.numbers(held * width).reshape(held, width)[:, :3])
    numbers = np.concatenate([np.empty(0, np.int64), *tags])
    if (
        len(numbers) != count
        or not len(numbers)
        or numbers.min() < 0
        or numbers.max() > 100 * count + 10_000_000
    ):
        raise ValueError("its nodes are not numbered as it tells")
    row_of = np.full(int(numbers.max()) + 2, -1)
    row_of[numbers] = np.arange(count)
    return np.concatenate(points), row_of


def _elements(sections: _Sections, file: Path) -> list[tuple[int, int, int, IntArray]]:
    """Return dimension, entity, type and node numbers (e, k) of each block of elements."""
    cursor = sections.cursor("Elements")
    if cursor is None:
        raise ValueError("it has no elements")
    blocks, _, _, _ = cursor.sizes(4).tolist()
    found = []
    for _ in range(blocks):
        dimension, entity, element_type = cursor.integers(3)
        (count,) = cursor.sizes(1).tolist()
        nodes = _NODES.get(element_type) or _OF_LESS_DIMENSIONS.get(element_type)
        if nodes is None:
            raise InputError(
                f"{file}: has elements of Gmsh's type {element_type}; read are tetrahedra of 4 and 10 nodes, pyramids "
                "of 5, wedges of 6 and hexahedra of 8: convert it where it was made"
            )
        rows = cursor.sizes(count * (1 + nodes)).reshape(count, 1 + nodes)
        found.append((dimension, entity, element_type, rows[:, 1:]))
    return found
