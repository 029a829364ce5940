"""The sheets of an .xlsx file as rows of cells."""

import io
import warnings
import zipfile
from collections.abc import Iterator
from datetime import date, datetime, time, timedelta
from pathlib import Path

import openpyxl
from openpyxl.cell.cell import Cell as SheetCell

from estimator.errors import InputError
from estimator.input_file import MOST_TEXT_BYTES, read_input, require_file
from estimator.uniaxial.reading.cells.grid import Cell, Grid, row_of

SUFFIXES = (".xlsx", ".xlsm")
_MAGIC = b"PK\x03\x04"
_MOST_UNPACKED = 300_000_000
_MOST_COLUMNS = 500
_MOST_ROWS = 1_000_000


def is_spreadsheet(file: Path) -> bool:
    """Tell by the beginning of a file, or where it cannot be read by its name, whether it is an .xlsx file.

    Raises
    ------
    InputError
        There is no such file, or it is a folder or a device.
    """
    require_file(file)
    try:
        with file.open("rb") as stream:
            return stream.read(len(_MAGIC)) == _MAGIC
    except OSError:
        return file.suffix.lower() in SUFFIXES


def read_spreadsheet(file: Path) -> list[Grid]:
    """Read all sheets.

    Raises
    ------
    InputError
        It cannot be read, or grows beyond all measure when it is unpacked.
    """
    content = read_input(file, MOST_TEXT_BYTES)
    refusal = f"{file}: is not readable as an .xlsx file; save it again with a spreadsheet program, or export it as CSV"
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            unpacked = sum(entry.file_size for entry in packed.infolist())
        if unpacked > _MOST_UNPACKED:
            raise InputError(f"{file}: unpacks to {unpacked / 1e6:.0f} MB; is it the right file?")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles that a machine's program leaves out
            book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
            grids = [_grid(file, sheet.title, sheet) for sheet in book.worksheets]
    except InputError:
        raise
    except Exception:  # noqa: BLE001 - a damaged part makes the library raise whatever it comes upon
        raise InputError(refusal) from None
    if not any(row.cells for grid in grids for row in grid.rows):
        raise InputError(f"{file}: no sheet holds anything")
    return grids


def _grid(file: Path, name: str, sheet: openpyxl.worksheet._read_only.ReadOnlyWorksheet) -> Grid:
    # the size that a machine's program writes into the sheet may be wrong, and would cut it
    sheet.reset_dimensions()
    rows = []
    for number, cells in enumerate(sheet.iter_rows(max_col=_MOST_COLUMNS), start=1):
        if number > _MOST_ROWS:
            raise InputError(f"{file}, sheet {name!r}: more than {_MOST_ROWS} rows; is it the right file?")
        rows.append(row_of(number, list(_values(cells))))
    return Grid(name=name, rows=tuple(rows), where=f"{file}, sheet {name!r}, row", how=f"sheet {name!r}")


def _values(cells: tuple[SheetCell, ...]) -> Iterator[Cell]:
    for cell in cells:
        value = cell.value
        if value is None:
            yield ""
        elif isinstance(value, bool):
            yield str(value)
        elif isinstance(value, int | float):
            # what is shown as 5 % is stored as 0.05
            yield f"{100 * value!r}%" if "%" in str(cell.number_format) else float(value)
        elif isinstance(value, datetime | date | time | timedelta):
            yield f"time {value}"
        else:
            yield str(value)
