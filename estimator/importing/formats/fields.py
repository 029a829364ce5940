"""Digital image correlation: a field of points in each of many frames, as one table with a row a frame."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimator.importing.table import Column, FloatArray, Table

_SAME = 1e-6  # of the field's extent


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Points that were followed.

    Attributes
    ----------
    reference : (m, d) in the undeformed body, d of 2 or 3
    displacement : (n, m, d), NaN where a point was lost
    unit : of both
    facts : of the file
    """

    reference: FloatArray
    displacement: FloatArray
    unit: str | None
    facts: Mapping[str, str]


def table_of_frames(frames: Frames, name: str = "points", time: FloatArray | None = None) -> Table:
    """Return the places of all points in all frames as columns ``p0000.x`` and so on."""
    places = frames.reference[None] + frames.displacement
    seen = np.isfinite(places).all(axis=2).any(axis=0)
    columns = [] if time is None else [Column("time", time, "s")]
    columns += [
        Column(f"p{point:04d}.{'xyz'[axis]}", places[:, point, axis], frames.unit)
        for point in np.flatnonzero(seen)
        for axis in range(places.shape[2])
    ]
    return Table(name, tuple(columns), None, frames.facts)


def reference_of(coordinates: FloatArray, displacement: FloatArray) -> FloatArray:
    """Return the undeformed places (m, d) of points whose coordinates (n, m, d) may be those of the deformed body.

    Programs differ in which they export: what is the same in every frame is the undeformed place.
    """
    extent = float(np.nanmax(coordinates) - np.nanmin(coordinates))
    as_given = np.nanmax(np.abs(coordinates - coordinates[:1]))
    if as_given <= _SAME * extent:
        return np.asarray(coordinates[0])
    back = coordinates - displacement
    if np.nanmax(np.abs(back - back[:1])) <= 1e3 * _SAME * extent:
        return np.asarray(back[0])
    return np.asarray(coordinates[0] - displacement[0])


def frames_of_mudic(arrays: Mapping[str, np.ndarray[Any, Any]]) -> Table | None:
    """Return the points of what ``Fields.coords()`` and ``Fields.disp()`` of muDIC gave; None where it is none.

    Both have the shape (elements, 2, i, j, frames), in pixels; the coordinates are those of the deformed body.
    """
    coords = next((arrays[name] for name in ("coords", "coordinates", "xy") if name in arrays), None)
    disp = next((arrays[name] for name in ("disp", "displacement", "displacements") if name in arrays), None)
    if (
        coords is None
        or disp is None
        or coords.ndim != 5
        or coords.shape != disp.shape
        or coords.shape[1] != 2
    ):
        return None
    rows = coords.shape[-1]
    places = np.moveaxis(coords, (4, 1), (0, -1)).reshape(rows, -1, 2).astype(np.float64)
    moved = np.moveaxis(disp, (4, 1), (0, -1)).reshape(rows, -1, 2).astype(np.float64)
    # seen (frames, elements, 2, i, j) -> (frames, points, 2)
    time = np.asarray(arrays["time"], dtype=np.float64).ravel() if "time" in arrays else None
    frames = Frames(reference_of(places, moved), moved, None, {"program": "muDIC", "unit": "pixels"})
    return table_of_frames(frames, time=time if time is not None and len(time) == rows else None)
