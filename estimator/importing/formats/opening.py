"""Opens a file or a folder of any of the formats, told by the content."""

import zipfile
from pathlib import Path

from estimator.errors import InputError
from estimator.importing.formats.c3d import MAGIC as C3D_MAGIC
from estimator.importing.formats.c3d import read_c3d
from estimator.importing.formats.dic_text import is_field, natural, read_frames, read_single
from estimator.importing.formats.grids import read_text_file, read_workbook
from estimator.importing.formats.hdf5 import read_hdf5
from estimator.importing.formats.matlab import read_matlab
from estimator.importing.formats.npz import read_npz
from estimator.importing.table import Source, Table
from estimator.input_file import require_file

_HDF5 = b"\x89HDF\r\n\x1a\n"
_ZIP = b"PK\x03\x04"
_TEXTS = (".csv", ".txt", ".tsv", ".dat", ".asc")
_OTHERS = (".xlsx", ".xlsm", ".npz", ".h5", ".hdf5", ".mat", ".c3d")
_MOST_FILES = 20_000


def read_source(path: Path | str) -> Source:
    """Read everything that a file, or all files of a folder, hold.

    Files of a folder that are frames of one field of points become one table with a row a frame; any other becomes a
    table under its own name.

    Raises
    ------
    InputError
        There is nothing, or it is of no format that can be read.
    """
    place = Path(path)
    return _read_folder(place) if place.is_dir() else _read_file(place)


def _read_file(file: Path) -> Source:
    require_file(file)
    with file.open("rb") as stream:
        head = stream.read(1024)
    if head.startswith(_ZIP):
        return read_npz(file) if _is_npz(file) else read_workbook(file)
    if head.startswith(_HDF5) or head[512:520] == _HDF5:
        return read_hdf5(file)
    if head.startswith(b"MATLAB 5.0 MAT-file"):
        return read_matlab(file)
    if len(head) > 1 and head[1] == C3D_MAGIC and 0 < head[0] < 32:
        return read_c3d(file)
    return read_single(file)


def _is_npz(file: Path) -> bool:
    try:
        with zipfile.ZipFile(file) as packed:
            return any(name.endswith(".npy") for name in packed.namelist())
    except Exception:  # noqa: BLE001 - of a damaged archive the reader of its kind tells what is wrong
        return file.suffix.lower() == ".npz"


def _read_folder(folder: Path) -> Source:
    files = sorted(
        (file for file in folder.iterdir() if file.suffix.lower() in (*_TEXTS, *_OTHERS) and file.is_file()),
        key=lambda file: natural(file.name),
    )[:_MOST_FILES]
    if not files:
        shown = ", ".join((*_TEXTS, *_OTHERS))
        raise InputError(f"{folder}: holds no file that can be imported ({shown}); name another folder")
    frames: list[tuple[Path, Table]] = []
    others: list[Source] = []
    for file in files:
        if file.suffix.lower() in _TEXTS:
            source = read_text_file(file)
            if is_field(source.tables[0]):
                frames.append((file, source.tables[0]))
                continue
            others.append(source)
        else:
            others.append(_read_file(file))
    field = [read_frames([f for f, _ in frames], [t for _, t in frames], folder)] if frames else []
    sources = [*field, *others]
    if len(sources) == 1:
        only = sources[0]
        return Source(folder, only.tables, only.how, only.y_down)
    tables = [table for source in sources for table in _named(source, folder)]
    how = "; ".join(f"{source.path.name}: {source.how}" for source in sources[:6])
    return Source(folder, tuple(tables), how, any(source.y_down for source in sources))


def _named(source: Source, folder: Path) -> list[Table]:
    """Return the tables of one file of a folder, under names that tell them apart."""
    if source.path == folder:
        return list(source.tables)
    stem = source.path.stem
    if len(source.tables) == 1:
        one = source.tables[0]
        return [Table(stem, one.columns, one.rate_hz, one.facts)]
    return [Table(f"{stem}.{one.name}", one.columns, one.rate_hz, one.facts) for one in source.tables]
