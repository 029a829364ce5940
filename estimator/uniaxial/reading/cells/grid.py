"""A file as rows of cells, before anything of it is understood."""

from dataclasses import dataclass
from typing import TypeAlias

Cell: TypeAlias = str | float
"""A text, or a number where the file holds numbers as such, as spreadsheets do."""


@dataclass(frozen=True, slots=True)
class Row:
    """Cells of one line, without the empty ones at its end; ``line`` counts from 1."""

    line: int
    cells: tuple[Cell, ...]

    def text(self, column: int) -> str:
        """Return a cell as text; empty where there is none."""
        return as_text(self.cells[column]) if column < len(self.cells) else ""

    @property
    def filled(self) -> list[str]:
        """The cells that hold something, as text."""
        return [text for text in map(as_text, self.cells) if text]


@dataclass(frozen=True, slots=True)
class Grid:
    """Rows of a text file or of a sheet.

    Attributes
    ----------
    name : of the sheet; empty for a text file
    rows : all rows, the empty ones as well
    where : how a message names the place, up to the line's number
    separator : of the columns of a text file; empty for a sheet
    how : how it was read, in words
    """

    name: str
    rows: tuple[Row, ...]
    where: str
    separator: str = ""
    how: str = ""

    def place(self, line: int) -> str:
        """Return how a message names a line."""
        return f"{self.where} {line}"


def row_of(line: int, cells: list[Cell]) -> Row:
    """Return a row without the empty cells at its end."""
    kept = [cell.strip() if isinstance(cell, str) else cell for cell in cells]
    while kept and kept[-1] == "":
        kept.pop()
    return Row(line, tuple(kept))


def as_text(cell: Cell) -> str:
    """Return a cell as text."""
    return cell if isinstance(cell, str) else f"{cell:.15g}"
