"""The numbers of a table's columns: every row is read or refused with its line."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.uniaxial.reading.cells.grid import Cell, Row, as_text
from estimator.uniaxial.reading.cells.numbers import NumberStyle, looks_like_number, settle
from estimator.uniaxial.reading.stated import Stated
from estimator.uniaxial.reading.tables.blocks import Block
from estimator.uniaxial.records import FloatArray

_LONGEST_SHOWN = 40


@dataclass(frozen=True, slots=True)
class Table:
    """The rows that are used, and those that are not.

    Attributes
    ----------
    block : that they stand in
    style : of its numbers
    rows : the rows, complete in the columns that are needed
    left_out : why others are missing
    """

    block: Block
    style: NumberStyle
    rows: tuple[Row, ...]
    left_out: tuple[str, ...]

    @property
    def lines(self) -> NDArray[np.intp]:
        """Line of each row."""
        return np.array([row.line for row in self.rows], dtype=np.intp)

    def numbers(self, column: int) -> FloatArray:
        """Return a column.

        Raises
        ------
        InputError
            A cell is no number.
        """
        return np.array([self._number(row, column) for row in self.rows], dtype=np.float64)

    def numbers_or_none(self, column: int) -> FloatArray | None:
        """Return a column that is only looked at; None where not all of it is numbers."""
        try:
            return self.numbers(column)
        except InputError:
            return None

    def in_percent(self, column: int) -> bool:
        """Tell whether every cell of a column has a percent sign."""
        return bool(self.rows) and all(row.text(column).endswith("%") for row in self.rows)

    def _number(self, row: Row, column: int) -> float:
        cell: Cell = row.cells[column] if column < len(row.cells) else ""
        try:
            return self.style.parse(cell)
        except ValueError:
            shown = as_text(cell)[:_LONGEST_SHOWN]
            raise InputError(
                f"{self.block.grid.place(row.line)}, field {column + 1}: {shown!r} is no number; correct it"
            ) from None


def table_of(block: Block, needed: Sequence[int], stated: Stated) -> Table:
    """Return the rows of a block that hold what is needed.

    Raises
    ------
    InputError
        A row has more fields than there are names, or a field that is needed is missing in the middle.
    """
    rows, totals = _without_totals([row for row in block.data if row.cells])
    for row in rows:
        if len(row.cells) > block.width:
            raise InputError(_surplus(block, row))
    filled = [all(row.text(column) for column in needed) for row in rows]
    end = max((i + 1 for i, full in enumerate(filled) if full), default=0)
    if not end and rows and not block.grid.separator:
        empty = next(column for column in needed if not any(row.text(column) for row in rows))
        raise InputError(
            f"{block.grid.place(block.header_line)}: {block.titles[empty].text!r} holds nothing; if it has formulas, "
            "save the file with a spreadsheet program, so that it holds their values"
        )
    if not end and rows:
        raise InputError(
            f"{block.grid.place(block.header_line)}: names {len(block.titles)} columns, and the rows below have "
            f"{max(len(row.cells) for row in rows)}; part names and numbers alike, by tabs, semicolons or commas"
        )
    for row, full in zip(rows[:end], filled[:end], strict=True):
        if not full:
            missing = next(column for column in needed if not row.text(column))
            raise InputError(
                f"{block.grid.place(row.line)}: field {missing + 1} ({block.titles[missing].text}) is empty; "
                "complete the row, or delete it"
            )
    ends_of_others = all(not row.text(column) for row in rows[end:] for column in needed)
    if len(rows) - end > 1 and not ends_of_others:
        line = rows[end].line
        raise InputError(
            f"{block.grid.place(line)}: the rows from here on are incomplete; complete or delete them"
        )
    left_out = []
    if len(rows) - end == 1 and len(block.titles) >= block.width:
        left_out.append(f"line {rows[end].line}: the last row is incomplete")
    if totals:
        left_out.append(
            f"{_lines([row.line for row in totals])}: named, as a maximum or a mean is, and no row of it"
        )
    if block.below:
        left_out.append(f"{_lines(block.below)}: below the table, and no row of it")
    style = (
        NumberStyle(stated.decimal)
        if stated.decimal
        else settle(_cells(block, rows[:end]), block.grid.separator)
    )
    return Table(block, style, tuple(rows[:end]), tuple(left_out))


def _without_totals(rows: Sequence[Row]) -> tuple[list[Row], list[Row]]:
    """Part off the rows at the end whose first cell is a word, where all others begin with a number."""
    end = len(rows)
    while end and rows[end - 1].text(0) and not looks_like_number(rows[end - 1].text(0)):
        end -= 1
    if not all(looks_like_number(row.text(0)) for row in rows[:end]) or not end:
        end = len(rows)
    return list(rows[:end]), list(rows[end:])


def _cells(block: Block, rows: Sequence[Row]) -> Iterator[tuple[str, int, Cell]]:
    """Yield the cells that tell how numbers are written, with their place."""
    for row in rows:
        where = block.grid.place(row.line)
        for column, cell in enumerate(row.cells):
            if looks_like_number(cell):
                yield where, column, cell


def _lines(lines: Sequence[int]) -> str:
    return f"line {lines[0]}" if len(lines) == 1 else f"lines {lines[0]} to {lines[-1]}"


def _surplus(block: Block, row: Row) -> str:
    hint = (
        "; if the comma is the decimal mark as well, export the file with semicolons or tabs between columns"
        if block.grid.separator == ","
        else "; correct the row"
    )
    return f"{block.grid.place(row.line)}: {len(row.cells)} fields, and {block.width} names above them{hint}"
