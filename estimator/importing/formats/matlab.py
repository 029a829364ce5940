"""MATLAB files of version 5 to 7.2; those of 7.3 are HDF5."""

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.importing.formats.arrays import Named, arrays_in, tables_of_arrays
from estimator.importing.formats.fields import table_of_frames
from estimator.importing.formats.ncorr import frames_of_ncorr
from estimator.importing.table import Source, require_tables

_WORKER = Path(__file__).with_name("matlab_worker.py")
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
    with TemporaryDirectory(prefix="matlab-") as folder:
        arrays = Path(folder) / "arrays.npz"
        try:
            child = subprocess.run(
                [sys.executable, "-P", str(_WORKER), str(file), str(arrays)],
                capture_output=True,
                timeout=_LONGEST_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise InputError(f"{file}: takes more than {_LONGEST_S:g} s to read; {refusal}") from None
        if child.returncode != 0:
            last = next(iter(child.stderr.decode("utf-8", "replace").strip().splitlines()[-1:]), "")
            kind = (
                last.partition(":")[0].rpartition(".")[2]
                if child.returncode > 0 and last
                else "it is damaged"
            )
            raise InputError(f"{file}: is not readable as a MATLAB file ({kind}); {refusal}")
        with np.load(arrays, allow_pickle=False) as loaded:
            named = dict(loaded)
    tree: dict[str, Any] = _unpacked(json.loads(named["nesting"].tobytes()), named)
    return tree


def _unpacked(nested: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Any:
    """Return a value from its nesting, as ``matlab_worker.py`` writes it."""
    if "struct" in nested:
        return {name: _unpacked(part, arrays) for name, part in nested["struct"].items()}
    if "list" in nested:
        return [_unpacked(part, arrays) for part in nested["list"]]
    if "objects" in nested:
        parts = np.empty(len(nested["objects"]), dtype=object)
        for place, part in enumerate(nested["objects"]):
            parts[place] = _unpacked(part, arrays)
        return parts
    return arrays[f"array_{nested['array']}"] if "array" in nested else None


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
