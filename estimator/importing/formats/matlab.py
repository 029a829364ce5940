"""MATLAB files of version 5 to 7.2; those of 7.3 are HDF5."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from estimator.errors import InputError
from estimator.importing.formats.arrays import Named, arrays_in, tables_of_arrays
from estimator.importing.formats.fields import table_of_frames
from estimator.importing.formats.ncorr import frames_of_ncorr
from estimator.importing.table import Source, require_tables


def read_matlab(file: Path) -> Source:
    """Read every array of numbers, those in structs by dotted names; of Ncorr, the points that it followed.

    Raises
    ------
    InputError
        It cannot be read.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore"
            )  # of duplicate names and of objects of classes, which are left out
            loaded = loadmat(str(file), simplify_cells=True)
    except Exception as error:  # noqa: BLE001 - a damaged file makes the library raise whatever it comes upon
        raise InputError(
            f"{file}: is not readable as a MATLAB file ({type(error).__name__}); save it again, or export it as CSV"
        ) from None
    tree: dict[str, Any] = {name: value for name, value in loaded.items() if not name.startswith("__")}
    if isinstance(tree.get("data_dic_save"), dict):
        frames = frames_of_ncorr(tree["data_dic_save"])
        if frames is not None:
            table = table_of_frames(frames)
            return Source(
                file, require_tables(file, [table], "is read as Ncorr"), "Ncorr in MATLAB", y_down=True
            )
    named: list[Named] = list(arrays_in(_numeric(tree)))
    return Source(file, require_tables(file, tables_of_arrays(named), "is read as MATLAB"), "MATLAB")


def _numeric(tree: dict[str, Any]) -> dict[str, Any]:
    """Return the tree with lists of structs as mappings by their place."""
    kept: dict[str, Any] = {}
    for name, value in tree.items():
        if isinstance(value, dict):
            kept[name] = _numeric(value)
        elif isinstance(value, list | np.ndarray) and np.asarray(value).dtype.kind == "O":
            parts = {str(place): part for place, part in enumerate(value) if isinstance(part, dict)}
            kept[name] = _numeric(parts)
        else:
            kept[name] = value
    return kept
