"""A text file as rows of cells: what parts its columns is settled once, by all of its lines."""

import csv
import re
from collections import Counter
from pathlib import Path

from estimator.errors import InputError
from estimator.uniaxial.reading.cells.decoding import decoded
from estimator.uniaxial.reading.cells.grid import Cell, Grid, Row, row_of
from estimator.uniaxial.reading.cells.numbers import looks_like_number
from estimator.uniaxial.reading.language.words import folded

_SPACES = "spaces"
_SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", _SPACES: "spaces"}
_BETWEEN_WORDS = re.compile(r"\s+(?![(\[])")
_WIDE = re.compile(r"\s{2,}(?![(\[])")
_COMMENT = re.compile(r"^\s*[#%]+\s+")
_LONGEST_LINE = 100_000


def read_text_layout(file: Path) -> Grid:
    """Read a text file.

    The separator is the one that makes the most lines of two or more numbers, as many in each as there are names.

    Raises
    ------
    InputError
        It cannot be read, or holds no table.
    """
    text, encoding = decoded(file)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for number, line in enumerate(lines, start=1):
        if len(line) > _LONGEST_LINE:
            raise InputError(
                f"{file}, line {number}: {len(line)} characters, more than a table's row has; is it the right file?"
            )
    candidates = {
        separator: [row_of(number, _split(line, separator)) for number, line in enumerate(lines, start=1)]
        for separator in _SEPARATORS
        if separator == _SPACES or sum(separator in line for line in lines) > 1
    }
    separator = max(candidates, key=lambda each: _fitting(candidates[each]))
    return Grid(
        name="",
        rows=tuple(candidates[separator]),
        where=f"{file}, line",
        separator=separator,
        how=f"columns parted by {_SEPARATORS[separator]}, text in {encoding}",
    )


def _split(line: str, separator: str) -> list[Cell]:
    if separator == _SPACES:
        return _split_at_spaces(_COMMENT.sub("", line).strip())
    if '"' not in line:
        return list(line.split(separator))
    return list(next(csv.reader([line], delimiter=separator, skipinitialspace=separator != "\t"), []))


def _split_at_spaces(line: str) -> list[Cell]:
    """Split at every space between numbers, at the wide ones where names of several words have wide ones between."""
    if not line:
        return []
    narrow = _BETWEEN_WORDS.split(line)
    wide = _WIDE.split(line)
    return list(narrow if len(wide) == 1 or all(map(looks_like_number, narrow)) else wide)


def _fitting(rows: list[Row]) -> tuple[int, int]:
    """Return how many rows of numbers are as wide as the last row of names before them, and how many there are."""
    widths: Counter[int] = Counter()
    fitting, named = 0, 0
    for row in rows:
        cells = [cell for cell in row.cells if cell != ""]
        numeric = sum(looks_like_number(cell) for cell in cells)
        if numeric > 1 and numeric == len(cells):
            widths[len(row.cells)] += 1
            fitting += len(row.cells) == named
        elif len(cells) > 1 and numeric == 0 and any(folded(str(cell)).strip("-_") for cell in cells):
            named = len(row.cells)
    return fitting, max(widths.values(), default=0)
