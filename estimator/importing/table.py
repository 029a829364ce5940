"""What every reader of a format returns: named columns of numbers, with units where they are known, and facts."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError

FloatArray: TypeAlias = NDArray[np.float64]

_MOST_SHOWN = 12


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One column: its name, its numbers (n,), NaN where there is none, and its unit in the file's spelling."""

    name: str
    values: FloatArray
    unit: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns of one length and one clock.

    Attributes
    ----------
    name : of the sheet, group or stream; unique in its source
    columns : by their place in the file
    rate_hz : rows a second, where the file states it
    facts : what the file says beside its columns, by the file's own names
    """

    name: str
    columns: tuple[Column, ...]
    rate_hz: float | None = None
    facts: Mapping[str, str] = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.columns[0].values) if self.columns else 0


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """Everything that was read from a file or a folder.

    Attributes
    ----------
    path : of it
    tables : those with two rows or more
    how : how it was read, in words
    y_down : whether y counts downwards, as in images
    remarks : what was left out or is damaged, a line each
    """

    path: Path
    tables: tuple[Table, ...]
    how: str
    y_down: bool = False
    remarks: tuple[str, ...] = ()

    def names(self) -> tuple[str, ...]:
        """Return what each column is called in a mapping: its name, or ``table:name`` where that is not unique."""
        return tuple(self.name_of(table, column) for table in self.tables for column in table.columns)

    def name_of(self, table: Table, column: Column) -> str:
        """Return what a column is called in a mapping."""
        count = sum(other.name == column.name for each in self.tables for other in each.columns)
        return column.name if count == 1 else f"{table.name}:{column.name}"

    def find(self, name: str, where: str) -> tuple[Table, Column]:
        """Return the column that a mapping names, with its table.

        Raises
        ------
        InputError
            There is none, or several.
        """
        found = [
            (table, column)
            for table in self.tables
            for column in table.columns
            if name in (column.name, f"{table.name}:{column.name}")
        ]
        if len(found) == 1:
            return found[0]
        names = self.names()
        shown = ", ".join(names[:_MOST_SHOWN]) + (" and more" if len(names) > _MOST_SHOWN else "")
        if found:
            raise InputError(
                f"{where}: {len(found)} columns are called {name!r}; write table:column ({shown})"
            )
        raise InputError(f"{where}: there is no column {name!r} in {self.path}; it has {shown}")


def table_of(
    name: str, columns: Iterable[tuple[str, FloatArray, str | None]], rate_hz: float | None = None
) -> Table:
    """Return a table of columns that are given as name, values and unit."""
    return Table(name, tuple(Column(*column) for column in columns), rate_hz)


def require_tables(path: Path, tables: Sequence[Table], how: str) -> tuple[Table, ...]:
    """Return the tables with at least two rows.

    Raises
    ------
    InputError
        There is none.
    """
    kept = tuple(table for table in tables if table.rows > 1)
    if not kept:
        raise InputError(f"{path}: {how}, and holds no columns of two or more numbers; is it the right file?")
    return kept
