"""MATLAB files of version 5 to 7.2; those of 7.3 are HDF5."""

import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from estimator.errors import InputError
from estimator.importing.formats.arrays import Named, arrays_in, tables_of_arrays
from estimator.importing.formats.fields import table_of_frames
from estimator.importing.formats.ncorr import frames_of_ncorr
from estimator.importing.table import Source, require_tables

# scipy.io.loadmat does not check what it reads: a damaged file makes it crash, and the process that it is in
_CHILD = """
import pickle, sys, warnings
warnings.simplefilter("ignore")
from scipy.io import loadmat
loaded = loadmat(sys.argv[1], simplify_cells=True)
pickle.dump(loaded, sys.stdout.buffer)
"""
_LONGEST_S = 300.0


def read_matlab(file: Path) -> Source:
    """Read every array of numbers, those in structs by dotted names; of Ncorr, the points that it followed.

    Raises
    ------
    InputError
        It cannot be read.
    """
    loaded = _loaded(file)
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


def _loaded(file: Path) -> dict[str, Any]:
    """Return what a process of its own has loaded."""
    refusal = "save it again, or export it as CSV"
    try:
        child = subprocess.run(
            [sys.executable, "-c", _CHILD, str(file)], capture_output=True, timeout=_LONGEST_S, check=False
        )
    except subprocess.TimeoutExpired:
        raise InputError(f"{file}: takes more than {_LONGEST_S:g} s to read; {refusal}") from None
    if child.returncode != 0:
        last = next(iter(child.stderr.decode("utf-8", "replace").strip().splitlines()[-1:]), "")
        kind = last.partition(":")[0].rpartition(".")[2] if child.returncode > 0 and last else "it is damaged"
        raise InputError(f"{file}: is not readable as a MATLAB file ({kind}); {refusal}")
    loaded: dict[str, Any] = pickle.loads(child.stdout)
    return loaded


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
