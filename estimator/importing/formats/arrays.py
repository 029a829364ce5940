"""Named arrays, as NPZ, HDF5 and MATLAB files hold them: those along time become columns, the rest facts."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimator.importing.table import Column, FloatArray, Table

_MOST_COLUMNS = 6000
_FEW = 12


@dataclass(frozen=True, slots=True, eq=False)
class Named:
    """An array by its name, with groups parted by dots, and its unit where the file says one."""

    name: str
    values: np.ndarray[Any, Any]
    unit: str | None = None


def tables_of_arrays(arrays: list[Named]) -> list[Table]:
    """Return one table for each number of rows that arrays have in common; text and single numbers are its facts.

    Time runs along the axis whose length most of the arrays share. An array (n, 3) becomes three columns ``name.x`` and
    so on, one (n, m, 3) three for each of m points, ``name.0.x``; an axis of two is x and y.
    """
    facts = {
        one.name: _as_text(one.values)
        for one in arrays
        if one.values.size == 1 or one.values.dtype.kind in "US"
    }
    numeric = [
        Named(one.name, np.squeeze(one.values).astype(np.float64), one.unit)
        for one in arrays
        if one.values.size > 1 and one.values.dtype.kind in "fiub"
    ]
    lengths = Counter(one.values.shape[0] for one in numeric if one.values.ndim == 1)
    if not lengths:
        lengths = Counter(max(one.values.shape) for one in numeric if one.values.ndim == 2)
    tables: dict[int, list[Column]] = {}
    for one in numeric:
        axis = _time_axis(one.values.shape, lengths)
        if axis is None:
            continue
        along = np.moveaxis(one.values, axis, 0)
        columns = [Column(name, values, one.unit) for name, values in _columns(one.name, along)]
        if len(columns) <= _MOST_COLUMNS:
            tables.setdefault(len(along), []).extend(columns)
    return [
        Table(f"table {number}", tuple(columns), None, facts)
        for number, columns in enumerate(tables.values(), start=1)
    ]


def arrays_in(tree: Mapping[str, Any], prefix: str = "") -> Iterator[Named]:
    """Yield the arrays of a tree of mappings, fields of structured arrays among them."""
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from arrays_in(value, f"{name}.")
            continue
        array = np.asarray(value)
        if array.dtype.names:
            for part in array.dtype.names:
                yield Named(f"{name}.{part}", np.asarray(array[part]))
        elif array.dtype.kind in "fiubUS":
            yield Named(name, array)


def _time_axis(shape: tuple[int, ...], lengths: Counter[int]) -> int | None:
    if len(shape) == 1:
        return 0
    if len(shape) > 3:
        return None
    shared = [axis for axis, size in enumerate(shape) if size in lengths]
    if shared:
        return max(shared, key=lambda axis: (lengths[shape[axis]], shape[axis]))
    longest = int(np.argmax(shape))
    return longest if shape[longest] > _FEW else 0


def _columns(name: str, along: FloatArray) -> list[tuple[str, FloatArray]]:
    if along.ndim == 1:
        return [(name, along)]
    if along.ndim == 2:
        return [(f"{name}.{part}", along[:, place]) for place, part in enumerate(_parts(along.shape[1]))]
    # the coordinates are the axis of two or three, the last where both are
    if along.shape[2] not in (2, 3) and along.shape[1] in (2, 3):
        along = np.swapaxes(along, 1, 2)
    parts = _parts(along.shape[2])
    return [
        (f"{name}.{point}.{part}", along[:, point, place])
        for point in range(along.shape[1])
        for place, part in enumerate(parts)
    ]


def _parts(count: int) -> tuple[str, ...]:
    return tuple("xyz"[:count]) if count in (2, 3) else tuple(str(place) for place in range(count))


def _as_text(values: np.ndarray[Any, Any]) -> str:
    return ", ".join(str(value) for value in values.ravel()[:_FEW].tolist())
