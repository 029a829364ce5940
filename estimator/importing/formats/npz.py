"""NPZ archives of NumPy arrays."""

import zipfile
from pathlib import Path

import numpy as np

from estimator.errors import InputError
from estimator.importing.formats.arrays import Named, arrays_in, tables_of_arrays
from estimator.importing.formats.fields import frames_of_mudic
from estimator.importing.table import Source, require_tables

_MOST_BYTES = 2_000_000_000


def read_npz(file: Path) -> Source:
    """Read the arrays; of a digital image correlation by muDIC, the points that it followed.

    Raises
    ------
    InputError
        It cannot be read, or holds pickled objects, which could run any program.
    """
    try:
        with zipfile.ZipFile(file) as packed:
            if sum(entry.file_size for entry in packed.infolist()) > _MOST_BYTES:
                raise InputError(
                    f"{file}: unpacks to more than {_MOST_BYTES / 1e9:.0f} GB; export what is needed"
                )
        with np.load(file, allow_pickle=False) as store:
            arrays = {name: store[name] for name in store.files}
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001 - a damaged archive makes numpy raise whatever it comes upon
        why = (
            "holds pickled objects; save plain arrays"
            if "pickle" in str(error)
            else "save it again with numpy.savez"
        )
        raise InputError(f"{file}: is not readable as NPZ ({type(error).__name__}); {why}") from None
    points = frames_of_mudic(arrays)
    if points is not None:
        return Source(
            file, require_tables(file, [points], "is read as muDIC"), "muDIC, in pixels", y_down=True
        )
    named: list[Named] = list(arrays_in(arrays))
    return Source(file, require_tables(file, tables_of_arrays(named), "is read as NPZ"), "NPZ")
