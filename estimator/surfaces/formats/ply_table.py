"""Rows of the elements of a PLY file, by columns; rows of one layout are read in one piece.

What a header counts is not believed: no more is read, and no more memory taken, than the file holds.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Property:
    """A column of an element: one value, or as many as a count before them tells; types as numpy names them."""

    name: str
    kind: str
    count_kind: str = ""


@dataclass(frozen=True, slots=True)
class Element:
    """A table of the file: its name, how many rows the header tells, and its columns in order."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Column:
    """The values of all rows, (k,) float64, and the places (n,) in them behind the last value of each row."""

    values: FloatArray
    ends: IntArray
    is_list: bool


class TextBody:
    """Rows of text, a line each."""

    def __init__(self, content: bytes, file: Path) -> None:
        text = content.decode("ascii", errors="replace")
        self._lines = [line for line in text.splitlines() if line and not line.isspace()]
        self._next = 0
        self._file = file

    def table(self, element: Element) -> Mapping[str, Column]:
        """Return the columns of the next element.

        Raises
        ------
        InputError
            A row is missing, or has other values than the header says; the message names it.
        """
        lines = self._lines[self._next : self._next + element.count]
        self._next += element.count
        if len(lines) < element.count:
            raise _missing(self._file, element, len(lines))
        rows = [line.split() for line in lines]
        values: dict[str, list[FloatArray]] = {one.name: [] for one in element.properties}
        lengths: dict[str, list[int]] = {one.name: [] for one in element.properties}
        try:
            if len({len(row) for row in rows}) == 1 and (whole := _uniform(np.array(rows, float), element)):
                return whole
        except ValueError:
            pass  # the row that is no row of numbers is named below
        for number, row in enumerate(rows):
            try:
                start = 0
                for one in element.properties:
                    length = 1
                    if one.count_kind:
                        length, start = int(row[start]), start + 1
                    if not 0 <= length <= len(row) - start:
                        raise ValueError
                    values[one.name].append(np.array(row[start : start + length], dtype=np.float64))
                    lengths[one.name].append(length)
                    start += length
            except (ValueError, IndexError):
                raise InputError(
                    f"{self._file}: {element.name} {number} (from 0) is {' '.join(row)[:60]!r}, not the values that "
                    "its header tells; export the surface again"
                ) from None
        return {
            one.name: Column(
                np.concatenate([np.empty(0), *values[one.name]]),
                np.cumsum(lengths[one.name], dtype=np.int64),
                bool(one.count_kind),
            )
            for one in element.properties
        }


class BinaryBody:
    """Rows of bytes, in the order of ``word``."""

    def __init__(self, content: bytes, word: np.dtype[np.int32], file: Path) -> None:
        self._content = content
        self._order = ">" if word == np.dtype(">i4") else "<"
        self._offset = 0
        self._file = file

    def table(self, element: Element) -> Mapping[str, Column]:
        """Return the columns of the next element.

        Raises
        ------
        InputError
            The file ends before the last row, or a list has a length that is none.
        """
        if not element.count:
            nothing = np.empty(0), np.empty(0, np.int64)
            return {one.name: Column(*nothing, bool(one.count_kind)) for one in element.properties}
        layout = self._layout(element, self._offset, 0)
        available = (len(self._content) - self._offset) // layout.itemsize
        rows = np.frombuffer(self._content, layout, min(element.count, available), self._offset)
        alike = np.ones(len(rows), dtype=bool)
        for one in element.properties:
            if one.count_kind:
                alike &= rows[f"{one.name} count"] == rows[f"{one.name} count"][:1]
        if len(rows) == element.count and alike.all():
            self._offset += element.count * layout.itemsize
            return {one.name: _column(rows[one.name], bool(one.count_kind)) for one in element.properties}
        return self._row_by_row(element)

    def _row_by_row(self, element: Element) -> Mapping[str, Column]:
        values: dict[str, list[NDArray[np.generic]]] = {one.name: [] for one in element.properties}
        for number in range(element.count):
            for one in element.properties:
                length = 1
                if one.count_kind:
                    length = int(self._take(one.count_kind, 1, element, number)[0])
                values[one.name].append(self._take(one.kind, length, element, number))
        return {
            one.name: Column(
                np.concatenate(values[one.name]).astype(np.float64),
                np.cumsum([len(row) for row in values[one.name]], dtype=np.int64),
                bool(one.count_kind),
            )
            for one in element.properties
        }

    def _layout(self, element: Element, offset: int, number: int) -> np.dtype[np.void]:
        """Return how the row at ``offset`` is laid out; the others may have longer lists."""
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        for one in element.properties:
            if not one.count_kind:
                fields.append((one.name, self._order + one.kind))
                continue
            fields.append((f"{one.name} count", self._order + one.count_kind))
            count_at = offset + np.dtype(fields).itemsize - np.dtype(one.count_kind).itemsize
            length = self._length(one, count_at, element, number)
            fields.append((one.name, self._order + one.kind, (length,)))
        return np.dtype(fields)

    def _length(self, one: Property, offset: int, element: Element, number: int) -> int:
        kind = np.dtype(self._order + one.count_kind)
        if offset + kind.itemsize > len(self._content):
            raise _missing(self._file, element, number)
        length = float(np.frombuffer(self._content, kind, 1, offset)[0])
        if not (length >= 0 and length == int(length)):
            raise InputError(
                f"{self._file}: {element.name} {number} (from 0) has {length:g} entries in {one.name}; "
                "export the surface again"
            )
        if length * np.dtype(one.kind).itemsize > len(self._content):
            raise _missing(self._file, element, number)
        return int(length)

    def _take(self, kind: str, count: int, element: Element, number: int) -> NDArray[np.generic]:
        size = count * np.dtype(kind).itemsize
        if not 0 <= size <= len(self._content) - self._offset:
            raise _missing(self._file, element, number)
        found = np.frombuffer(self._content, np.dtype(self._order + kind), count, self._offset)
        self._offset += size
        return found


def _uniform(rows: FloatArray, element: Element) -> dict[str, Column] | None:
    """Return the columns of rows (n, w) whose lists have the same lengths in all of them; None where they have not."""
    columns, start = {}, 0
    for one in element.properties:
        length = 1
        if one.count_kind:
            counts = rows[:, start]
            if np.any(counts != counts[0]) or not 0 <= counts[0] == int(counts[0]):
                return None
            length, start = int(counts[0]), start + 1
        if start + length > rows.shape[1]:
            return None
        columns[one.name] = _column(rows[:, start : start + length], bool(one.count_kind))
        start += length
    return columns


def _column(rows: NDArray[np.generic], is_list: bool) -> Column:
    """Return the column of rows (n,) or (n, length)."""
    length = rows.shape[1] if rows.ndim == 2 else 1
    ends = length * np.arange(1, len(rows) + 1, dtype=np.int64)
    return Column(rows.reshape(-1).astype(np.float64), ends, is_list)


def _missing(file: Path, element: Element, held: int) -> InputError:
    return InputError(
        f"{file}: its header counts {element.count} {element.name} elements, the file ends within number {held} "
        "(from 0): it is cut short; export the surface again, or copy it again"
    )
