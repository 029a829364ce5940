"""Label maps in NRRD, with an attached or a detached header, and the segments that 3D Slicer names in it."""

import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import nrrd
import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.segmentation.label_map import LabelMap, Segment, first_line, whole_numbers

FloatArray = NDArray[np.float64]

# What turns a space of the format's definition into LPS.
_TO_LPS = {
    "left-posterior-superior": (1.0, 1.0, 1.0),
    "lps": (1.0, 1.0, 1.0),
    "right-anterior-superior": (-1.0, -1.0, 1.0),
    "ras": (-1.0, -1.0, 1.0),
    "left-anterior-superior": (1.0, -1.0, 1.0),
    "las": (1.0, -1.0, 1.0),
}
# Right-handed frames that say nothing of a patient are taken as they are.
_OF_NO_PATIENT = ("scanner-xyz", "3d-right-handed")
_UNITS_MM = {"mm": 1.0, "millimeter": 1.0, "millimeters": 1.0, "m": 1e3, "cm": 10.0, "um": 1e-3, "µm": 1e-3}
_DAMAGED = (nrrd.NRRDError, OSError, EOFError, ValueError, KeyError, IndexError, TypeError, MemoryError)


def read_nrrd(file: Path) -> LabelMap:
    """Return the labels of a file, and of the data file that it names.

    Raises
    ------
    InputError
        It is damaged, its data are missing, or it does not say where its voxels lie.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            values, header = nrrd.read(str(file), index_order="F")
    except _DAMAGED as error:
        raise InputError(f"{file}: cannot be read as NRRD ({first_line(error)}); save it again") from None
    if "space directions" not in header:
        stated = ", ".join(one for one in ("spacings", "axis mins", "axis maxs") if one in header) or "sizes"
        raise InputError(
            f"{file}: has no space directions, only {stated}, which programs read differently; save it with its "
            "orientation"
        )
    directions = np.array(header["space directions"], dtype=np.float64)
    spatial = np.asarray(~np.isnan(directions).any(axis=1))
    if spatial.sum() != 3 or directions.shape[1] != 3 or len(spatial) != values.ndim:
        raise InputError(
            f"{file}: {int(spatial.sum())} of its {values.ndim} axes lie in space; three have to"
        )
    signs, remarks = _signs(header, file)
    T_lps_index = np.eye(4)
    T_lps_index[:3, :3] = directions[spatial].T
    T_lps_index[:3, 3] = header.get("space origin", np.zeros(3))
    T_lps_index[:3] *= signs[:, None]
    if "space origin" not in header:
        remarks = (*remarks, "states no space origin; its first voxel is taken to lie at 0")
    listed = np.moveaxis(values, np.flatnonzero(~spatial), range(int((~spatial).sum())))
    labels = whole_numbers(listed.reshape(-1, *listed.shape[-3:]), str(file))
    return LabelMap(tuple(labels), T_lps_index, _segments(header), remarks)


def _signs(header: Mapping[str, Any], file: Path) -> tuple[FloatArray, tuple[str, ...]]:
    """Return what the three coordinates are to be multiplied by to be in LPS and millimetres."""
    space = str(header.get("space", "")).lower()
    units = {str(unit).strip().lower() for unit in header.get("space units", ())} - {"", "none"}
    if len(units) > 1 or not units <= set(_UNITS_MM):
        raise InputError(f"{file}: its space units are {', '.join(sorted(units))}; write it in mm")
    scale = _UNITS_MM[units.pop()] if units else 1.0
    if space in _TO_LPS:
        return scale * np.array(_TO_LPS[space]), ()
    if space and space not in _OF_NO_PATIENT:
        raise InputError(f"{file}: its space is {space[:40]}, which may be mirrored; save it in LPS or RAS")
    return np.full(3, scale), (f"states {space or 'no space'}; its axes are taken as those of LPS",)


def _segments(header: Mapping[str, Any]) -> tuple[Segment, ...]:
    found = []
    for key, name in header.items():
        if match := re.fullmatch(r"Segment(\d+)_Name", key):
            value = header.get(f"Segment{match[1]}_LabelValue", "")
            layer = header.get(f"Segment{match[1]}_Layer", "0")
            if str(value).isdecimal() and str(layer).isdecimal():
                found.append(Segment(str(name), int(value), int(layer)))
    return tuple(found)
