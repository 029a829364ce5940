"""Ncorr, a digital image correlation in MATLAB: what it saves as ``data_dic_save``."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimator.importing.formats.fields import Frames
from estimator.importing.table import FloatArray


def frames_of_ncorr(saved: Mapping[str, Any]) -> Frames | None:
    """Return the points of an analysis, in the unit that it was calibrated in, else in pixels.

    The displacements are those of the undeformed image ("reference"), calibrated; its grid has ``spacing + 1`` pixels
    from point to point. The first frame that is returned is the undeformed image itself, which Ncorr leaves out. Where
    both components are exactly zero nothing was followed.

    Parameters
    ----------
    saved : the struct ``data_dic_save`` as nested mappings, a struct array in it as a list
    """
    info = saved.get("dispinfo", {})
    fields = _fields(saved.get("displacements"))
    if not fields or not isinstance(info, Mapping):
        return None
    spacing = _number(info.get("spacing"), 0.0) + 1.0
    scale = _number(info.get("pixtounits"), 1.0)
    unit = str(info.get("units", "")) if scale != 1.0 else ""
    u = np.stack([one[0] for one in fields])
    v = np.stack([one[1] for one in fields])
    rows, columns = np.indices(u.shape[1:])
    reference = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(np.float64) * (spacing * scale)
    moved = np.stack([u.reshape(len(u), -1), v.reshape(len(v), -1)], axis=2)
    moved[np.all(moved == 0, axis=2)] = np.nan
    followed = np.isfinite(moved).any(axis=(0, 2))
    undeformed = np.zeros_like(moved[:1])
    facts = {"program": "Ncorr", "first row": "the undeformed image"}
    return Frames(reference[followed], np.concatenate([undeformed, moved])[:, followed], unit or None, facts)


def _fields(displacements: Any) -> list[tuple[FloatArray, FloatArray]]:
    """Return the two components of each frame, however the file nests them."""
    if isinstance(displacements, Mapping):
        u, v = (displacements.get(f"plot_{axis}_ref_formatted") for axis in "uv")
        if isinstance(u, list) and isinstance(v, list):
            return [(_plane(a), _plane(b)) for a, b in zip(u, v, strict=False)]
        return [] if u is None or v is None else [(_plane(u), _plane(v))]
    if isinstance(displacements, list | np.ndarray):
        return [pair for one in displacements if isinstance(one, Mapping) for pair in _fields(one)]
    return []


def _plane(values: Any) -> FloatArray:
    return np.atleast_2d(np.asarray(values, dtype=np.float64))


def _number(value: Any, default: float) -> float:
    array = np.asarray(value if value is not None else default, dtype=np.float64).ravel()
    return float(array[0]) if len(array) and np.isfinite(array[0]) else default
