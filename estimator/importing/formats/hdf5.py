"""HDF5 files, and MATLAB files of version 7.3, which are HDF5 with MATLAB's ways of writing."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from estimator.errors import InputError
from estimator.importing.formats.arrays import Named, tables_of_arrays
from estimator.importing.formats.fields import Frames, table_of_frames
from estimator.importing.formats.ncorr import frames_of_ncorr
from estimator.importing.table import Source, require_tables

_MOST_VALUES = 200_000_000
_UNIT_NAMES = ("unit", "units", "Unit", "Units", "UNIT")
_MOST_REFERENCES = 10_000


def read_hdf5(file: Path) -> Source:
    """Read every dataset of numbers; of Ncorr, the points that it followed.

    Raises
    ------
    InputError
        It cannot be read, or holds more than fits in memory.
    """
    try:
        with h5py.File(str(file), "r") as store:
            matlab = _is_matlab(file)
            frames = (
                frames_of_ncorr(_matlab_tree(store, "data_dic_save")) if "data_dic_save" in store else None
            )
            arrays = [] if frames is not None else _arrays(store, matlab)
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001 - a damaged file makes the library raise whatever it comes upon
        raise InputError(
            f"{file}: is not readable as HDF5 ({type(error).__name__}); save it again, or export it as CSV"
        ) from None
    how = "MATLAB 7.3" if matlab else "HDF5"
    if frames is not None:
        return _of_frames(file, frames, f"Ncorr in {how}")
    return Source(file, require_tables(file, tables_of_arrays(arrays), f"is read as {how}"), how)


def _of_frames(file: Path, frames: Frames, how: str) -> Source:
    table = table_of_frames(frames)
    return Source(file, require_tables(file, [table], f"is read as {how}"), how, y_down=True)


def _is_matlab(file: Path) -> bool:
    with file.open("rb") as stream:
        return stream.read(6) == b"MATLAB"


def _arrays(store: Any, matlab: bool) -> list[Named]:
    found: list[Named] = []

    def visit(name: str, item: object) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#"):
            return
        if item.size is None or item.size > _MOST_VALUES:
            raise InputError(f"{store.filename}: {name} holds {item.size} values; export what is needed")
        values = _text(item) if matlab and item.attrs.get("MATLAB_class") == b"char" else item[()]
        array = np.asarray(values)
        unit = next((_word(item.attrs[key]) for key in _UNIT_NAMES if key in item.attrs), None)
        dotted = name.replace("/", ".")
        if array.dtype.names:
            found.extend(
                Named(f"{dotted}.{part}", np.asarray(array[part]), unit) for part in array.dtype.names
            )
        elif array.dtype.kind in "fiubUS":
            # MATLAB writes its columns as rows
            found.append(Named(dotted, array.T if matlab else array, unit))
        elif array.dtype.kind == "O" and array.size == 1:
            found.append(Named(dotted, np.array(_word(array.ravel()[0]))))

    store.visititems(visit)
    return found


def _matlab_tree(store: Any, name: str) -> dict[str, Any]:
    """Return a struct as nested mappings; a struct array, or a cell array, as lists."""
    return {key: _matlab_value(store, item) for key, item in store[name].items()}


def _matlab_value(store: Any, item: Any, depth: int = 0) -> Any:
    if isinstance(item, h5py.Group):
        return {key: _matlab_value(store, part, depth + 1) for key, part in item.items()}
    if item.attrs.get("MATLAB_class") == b"char":
        return _text(item)
    values = np.asarray(item[()])
    if values.dtype == h5py.ref_dtype or values.dtype.kind == "O":
        references = values.ravel()[:_MOST_REFERENCES]
        if depth > 6:  # as deep as any of Ncorr's
            return None
        return [_matlab_value(store, store[reference], depth + 1) for reference in references if reference]
    return values.T


def _text(item: Any) -> str:
    return "".join(chr(int(code)) for code in np.asarray(item[()]).ravel())


def _word(value: object) -> str:
    array = np.asarray(value).ravel()
    one = array[0] if len(array) else ""
    return one.decode("utf-8", "replace") if isinstance(one, bytes) else str(one)
