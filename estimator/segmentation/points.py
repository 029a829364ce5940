"""Points that a user gives for a registration: pairs of fiducials, or points on the surface, in millimetres."""

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.input_file import parse_number, read_input_text
from estimator.surfaces.reading import read_surface

FloatArray = NDArray[np.float64]

_IMAGE = ("image_x_mm", "image_y_mm", "image_z_mm")
_TISSUE = ("tissue_x_mm", "tissue_y_mm", "tissue_z_mm")
_POINT = ("x_mm", "y_mm", "z_mm")


def read_fiducials(file: Path) -> tuple[FloatArray, FloatArray]:
    """Return where fiducials are in the image and in the tissue frame, both (n, 3), m.

    Raises
    ------
    InputError
        A column is missing, or a field is no number; the message names it.
    """
    found = _columns(file, (*_IMAGE, *_TISSUE))
    return found[:, :3], found[:, 3:]


def read_points(file: Path) -> FloatArray:
    """Return points on the surface of the organ, (n, 3), tissue frame, m: of a table, or the corners of a surface.

    Raises
    ------
    InputError
        The file is neither, a column is missing, or a field is no number.
    """
    if file.suffix.lower() == ".csv":
        return _columns(file, _POINT)
    return read_surface(file).surface.vertices


def _columns(file: Path, names: Sequence[str]) -> FloatArray:
    """Return the columns of a table, (n, c), m."""
    rows = csv.DictReader(StringIO(read_input_text(file)), skipinitialspace=True)
    missing = [name for name in names if name not in (rows.fieldnames or ())]
    if missing:
        raise InputError(f"{file}: has no column {missing[0]}; its first line has to name {', '.join(names)}")
    values = []
    try:
        for row in rows:
            values.append([_finite(row[name]) for name in names])
    except (ValueError, csv.Error) as error:
        raise InputError(f"{file}: row {len(values) + 1} (from 1): {error}; write millimetres") from None
    return 1e-3 * np.array(values, dtype=np.float64).reshape(-1, len(names))


def _finite(text: str | None) -> float:
    value = parse_number((text or "").strip())
    if not np.isfinite(value):
        raise ValueError(f"{text!r} is no finite number")
    return value
