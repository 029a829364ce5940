"""Text files and spreadsheets: the rows of cells as columns, each with the name and the unit above it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from estimator.errors import InputError
from estimator.importing.formats.clock_times import seconds_of_stamps
from estimator.importing.formats.grouped_names import grouped_names
from estimator.importing.table import Column, Source, Table, require_tables
from estimator.importing.units import quantity_of
from estimator.uniaxial.reading.cells.grid import Cell, Grid, Row
from estimator.uniaxial.reading.cells.numbers import NumberStyle, looks_like_number, settle
from estimator.uniaxial.reading.cells.spreadsheet import read_spreadsheet
from estimator.uniaxial.reading.cells.text_layout import read_text_layout

_FEWEST_ROWS = 2
_MOST_EMPTY = 0.9
_COMMENT = "#%"
_LONGEST_FACT = 200


def read_text_file(file: Path) -> Source:
    """Read a text file of any usual layout.

    Raises
    ------
    InputError
        It cannot be read, holds no table, or its numbers can be read in two ways.
    """
    grid = read_text_layout(file)
    return Source(file, require_tables(file, [table_of_grid(grid)], f"is read as text, {grid.how}"), grid.how)


def read_workbook(file: Path) -> Source:
    """Read the sheets of a spreadsheet that hold a table.

    Raises
    ------
    InputError
        It cannot be read, or no sheet holds a table.
    """
    tables = [table_of_grid(grid) for grid in read_spreadsheet(file) if _has_table(grid.rows)]
    return Source(
        file, require_tables(file, tables, "is read as .xlsx"), f"{len(tables)} sheets with a table"
    )


def table_of_grid(grid: Grid) -> Table:
    """Return the longest table of a grid: the names in its last row of words above, and all rows of numbers below.

    Where nothing but numbers stands there, the columns are called ``column 1`` and so on.

    Raises
    ------
    InputError
        There are no rows of numbers, or numbers can be read in two ways.
    """
    header = _header(grid.rows)
    units, data = _units_and_data(grid.rows, header) if header is not None else ({}, _only_numbers(grid.rows))
    if not data:
        raise InputError(
            f"{grid.place(1)}: no line of names stands above rows of numbers; write the names of the columns above them"
        )
    width = max(len(row.cells) for row in data)
    names = [f"column {place + 1}" for place in range(width)] if header is None else _names(grid.rows, header)
    style = settle(_numbers(grid, data), grid.separator)
    columns = []
    for place, name in enumerate(names):
        values = np.array([_number(row, place, style) for row in data])
        if name and np.isnan(values).mean() <= _MOST_EMPTY:
            columns.append(Column(name, values, units.get(place)))
        elif name and (seconds := seconds_of_stamps([row.text(place) for row in data])) is not None:
            columns.append(Column(name, seconds, "s"))
    return Table(grid.name or "table", tuple(columns), None, _facts(grid.rows[: header or 0]))


def _only_numbers(rows: tuple[Row, ...]) -> list[Row]:
    """Return the rows of a grid in which all that stands there are two or more numbers in each row."""
    filled = [row for row in rows if row.filled]
    plain = all(len(row.filled) > 1 and all(map(looks_like_number, row.filled)) for row in filled)
    return filled if plain and len(filled) >= _FEWEST_ROWS else []


def _has_table(rows: tuple[Row, ...]) -> bool:
    return _header(rows) is not None or bool(_only_numbers(rows))


def _header(rows: tuple[Row, ...]) -> int | None:
    """Return the place of the names: the last row of words above the first long run of numbers."""
    best: tuple[int, int] | None = None
    place = 0
    while place < len(rows):
        if not _is_names(rows[place]):
            place += 1
            continue
        _, data = _units_and_data(rows, place)
        if len(data) >= _FEWEST_ROWS and (best is None or len(data) > best[0]):
            best = (len(data), place)
        place += 1
    return None if best is None else best[1]


def _is_names(row: Row) -> bool:
    cells = row.filled
    return len(cells) >= 2 and not any(looks_like_number(cell) for cell in cells)


def _units_and_data(rows: tuple[Row, ...], header: int) -> tuple[dict[int, str], list[Row]]:
    units: dict[int, str] = {}
    begin = header + 1
    while begin < len(rows) and begin <= header + 3:
        cells = rows[begin].filled
        if cells and any(looks_like_number(cell) for cell in cells):
            break
        if _is_names(rows[begin]) and not _is_units(rows[begin]):
            return {}, []  # the names stand below
        if _is_units(rows[begin]):
            units = {
                place: cell.strip("[]() ")
                for place, cell in enumerate(map(str, rows[begin].cells))
                if cell.strip()
            }
        begin += 1
    width = len(rows[header].cells)
    data = []
    for row in rows[begin:]:
        cells = row.filled
        if not cells:
            continue
        if len(row.cells) > width + 1 or not any(looks_like_number(cell) for cell in cells):
            break
        data.append(row)
    return units, data


def _is_units(row: Row) -> bool:
    cells = [cell.strip("[]() ") for cell in row.filled]
    known = sum(quantity_of(cell) is not None or cell in ("-", "1", "") for cell in cells)
    return bool(cells) and 2 * known >= len(cells)


def _names(rows: tuple[Row, ...], header: int) -> list[str]:
    """Return the names of the columns; one that stands there again gets the number of its place."""
    row = rows[header]
    found = [row.text(place).strip().strip('"') for place in range(len(row.cells))]
    found[0] = found[0].lstrip(_COMMENT).strip()
    names: list[str] = []
    for place, name in enumerate(grouped_names(found, rows[:header])):
        names.append(f"{name} ({place + 1})" if name in names else name)
    return names


def _numbers(grid: Grid, data: list[Row]) -> Iterator[tuple[str, int, Cell]]:
    for row in data:
        for place, cell in enumerate(row.cells):
            if looks_like_number(cell):
                yield grid.place(row.line), place, cell


def _number(row: Row, place: int, style: NumberStyle) -> float:
    """Return a cell as a number, NaN where none is there."""
    if place >= len(row.cells):
        return float("nan")
    try:
        return style.parse(row.cells[place])
    except ValueError:
        return float("nan")


def _facts(rows: tuple[Row, ...]) -> dict[str, str]:
    """Return the lines above the names that are a name and a value."""
    facts = {}
    for row in rows:
        cells = row.filled
        if len(cells) == 1 and ":" in cells[0]:
            name, _, value = cells[0].partition(":")
            cells = [name, value]
        if 2 <= len(cells) <= 3:
            facts[cells[0].strip(": #*")] = " ".join(cells[1:]).strip()[:_LONGEST_FACT]
    return facts
