"""Where the tables of a file stand: names, a row of units, rows of numbers; one or several specimens.

Specimens stand below each other, beside each other, or on sheets of their own.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from estimator.errors import InputError
from estimator.uniaxial.reading.cells.grid import Grid, Row
from estimator.uniaxial.reading.cells.numbers import looks_like_number, rough_number
from estimator.uniaxial.reading.language.titles import Title, understood
from estimator.uniaxial.reading.language.units import dimension_of
from estimator.uniaxial.reading.language.vocabulary import SPECIMEN_WORDS
from estimator.uniaxial.reading.language.words import has_word, words_of

FEWEST_ROWS = 6
"""Of a test."""

_LOADS = ("stress", "force")
_LENGTHS = ("strain", "extension", "position", "height")
_ROWS_BETWEEN = 4  # names, a second row of names, units, an empty row
_LONGEST_PAUSE = 20.0  # in steps of time, between the parts of a table whose names are written again
_MOST_SHOWN = 8
_LONGEST_LABEL = 60
_LABEL_WORDS = ("label", "name", "id", "nr", "nr.", "no", "no.", "number", "bezeichnung")


@dataclass(frozen=True, slots=True)
class Block:
    """The table of one specimen.

    Attributes
    ----------
    grid : that it stands in
    label : the specimen's, empty where the file gives none
    titles : of the columns that are the specimen's, by their place
    width : columns of the whole table
    above : rows above the table, back to the table before it
    data : rows of the table
    header_line : line of the names
    below : lines that stand below the table and are none of it
    """

    grid: Grid
    label: str
    titles: dict[int, Title]
    width: int
    above: tuple[Row, ...]
    data: tuple[Row, ...]
    header_line: int
    below: tuple[int, ...] = ()


def find_blocks(grids: Sequence[Grid]) -> list[Block]:
    """Return the tables of all grids, in their order; short ones only where there is no other.

    Raises
    ------
    InputError
        There is none, or a row of numbers stands above the names.
    """
    found = [block for grid in grids for block in _blocks_in(grid)]
    # a table of results has a row or two for each specimen
    blocks = [block for block in found if sum(map(_has_numbers, block.data)) >= FEWEST_ROWS] or found
    if len({block.grid.name for block in blocks}) > 1:
        blocks = [replace(block, label=block.label or block.grid.name) for block in blocks]
    return blocks


def unknown_names(grids: Sequence[Grid]) -> str:
    """Return, for a message, the names of a table whose columns are not known; empty where there is none."""
    for grid in grids:
        for place, row in enumerate(grid.rows):
            numbers = [r for r in grid.rows[place + 1 : place + 2 + _ROWS_BETWEEN] if _is_numbers(r)]
            named = len(row.filled) > 1 and not any(map(looks_like_number, row.filled))
            if named and numbers and not _is_units_row(row):
                shown = ", ".join(map(repr, row.filled[:_MOST_SHOWN]))
                return f"{grid.place(row.line)}: the columns are {shown}"
    return ""


def chosen_block(blocks: Sequence[Block], wanted: str | None, where: str) -> tuple[Block, int]:
    """Return the block that is wanted, the first by default, and its place among all.

    Raises
    ------
    InputError
        There is none of this number or label.
    """
    if wanted is None:
        return blocks[0], 0
    labels = [" ".join(words_of(block.label)) for block in blocks]
    asked = " ".join(words_of(wanted))
    if asked in labels:
        place = labels.index(asked)
    elif wanted.isdigit() and 1 <= int(wanted) <= len(blocks):
        place = int(wanted) - 1
    else:
        raise InputError(f"{where}: has no specimen {wanted!r}; it has {listed(blocks)}")
    return blocks[place], place


def listed(blocks: Sequence[Block]) -> str:
    """Return the numbers and labels of all blocks, for a message."""
    shown = [
        f"{number} ({block.label})" if block.label else str(number)
        for number, block in enumerate(blocks[:_MOST_SHOWN], start=1)
    ]
    more = f" and {len(blocks) - _MOST_SHOWN} more" if len(blocks) > _MOST_SHOWN else ""
    return f"{', '.join(shown)}{more}"


def _blocks_in(grid: Grid) -> Iterator[Block]:
    for whole in _joined(_tables_in(grid)):
        yield from _side_by_side(whole)


def _joined(tables: Iterable[Block]) -> list[Block]:
    """Join tables with the same names whose time goes on: names that are written again within one test."""
    found: list[Block] = []
    for table in tables:
        if found and _goes_on(found[-1], table):
            found[-1] = replace(found[-1], data=(*found[-1].data, *table.data), below=table.below)
        else:
            found.append(table)
    return found


def _goes_on(one: Block, other: Block) -> bool:
    if [title.text for title in one.titles.values()] != [title.text for title in other.titles.values()]:
        return False
    column = next((column for column, title in one.titles.items() if title.quantity == "time"), None)
    times = (
        []
        if column is None
        else [rough_number(row.text(column)) for row in (*one.data, *other.data) if row.filled]
    )
    before, steps = sum(bool(row.filled) for row in one.data), np.diff(times)
    return bool(
        0 < before < len(times)
        and np.all(steps >= 0)
        and steps[before - 1] <= _LONGEST_PAUSE * np.median(steps[: before - 1] if before > 1 else steps)
    )


def _tables_in(grid: Grid) -> Iterator[Block]:
    rows = grid.rows
    headers = [i for i in range(len(rows)) if _is_header(rows, i)]
    begin = 0
    for number, header in enumerate(headers):
        following = headers[number + 1] if number + 1 < len(headers) else len(rows)
        first = _first_of_data(rows, header)
        if number == 0:
            _refuse_numbers_above(grid, rows[:header], len(rows[header].cells))
        end = _end_of_data(rows, first, following, len(rows[first].cells))
        units = _units_row(rows, header, first)
        titles = {
            column: understood(rows[header].text(column), units.text(column) if units else "")
            for column in range(len(rows[header].cells))
        }
        left = tuple(row.line for row in rows[end:following] if row.filled) if following == len(rows) else ()
        yield Block(
            grid=grid,
            label="",
            titles=titles,
            width=max(len(rows[header].cells), len(units.cells) if units else 0),
            above=rows[begin:header],
            data=rows[first:end],
            header_line=rows[header].line,
            below=left,
        )
        begin = end


def _is_header(rows: Sequence[Row], place: int) -> bool:
    """Tell whether a row names a length and a load, and numbers follow."""
    cells = rows[place].filled
    if len(cells) < 2 or any(looks_like_number(cell) for cell in cells):
        return False
    units = rows[place + 1] if place + 1 < len(rows) and _is_units_row(rows[place + 1]) else None
    kinds = {
        understood(rows[place].text(column), units.text(column) if units else "").quantity
        for column in range(len(rows[place].cells))
    }
    if not (kinds.intersection(_LOADS) and kinds.intersection(_LENGTHS)):
        return False
    first = _first_of_data(rows, place)
    return first < len(rows) and not any(_names_columns(rows[i]) for i in range(place + 1, first))


def _names_columns(row: Row) -> bool:
    kinds = {understood(cell).quantity for cell in row.filled} if len(row.filled) > 1 else set()
    return bool(kinds.intersection(_LOADS) and kinds.intersection(_LENGTHS)) and not _is_units_row(row)


def _first_of_data(rows: Sequence[Row], header: int) -> int:
    """Return the place of the first row that holds numbers, right behind names and units; past the end if none."""
    for place in range(header + 1, min(header + 1 + _ROWS_BETWEEN, len(rows))):
        cells = rows[place].filled
        if len(cells) > 1 and sum(map(looks_like_number, cells)) * 2 > len(cells):
            return place
    return len(rows)


def _units_row(rows: Sequence[Row], header: int, first: int) -> Row | None:
    return next((rows[i] for i in range(header + 1, first) if _is_units_row(rows[i])), None)


def _is_units_row(row: Row) -> bool:
    """Tell whether a row holds units, most of them known."""
    cells = row.filled
    known = sum(dimension_of(cell) is not None for cell in cells)
    bracketed = sum(cell[:1] in "([" and cell[-1:] in ")]" for cell in cells)
    return (
        bool(cells) and not all(map(looks_like_number, cells)) and 2 * max(known, bracketed) >= len(cells) > 0
    )


def _end_of_data(rows: Sequence[Row], first: int, following: int, width: int) -> int:
    """Return the place behind the last row of a table: before words with no row of numbers behind them."""
    last = max(
        (i for i in range(first, following) if _is_numbers(rows[i]) and len(rows[i].cells) == width),
        default=first,
    )
    for place in range(last + 1, following):
        cells = rows[place].filled
        if not cells or all(map(looks_like_number, cells)):
            continue
        next_names = following < len(rows) and not any(map(looks_like_number, cells))
        if next_names or not rows[place - 1].filled:
            return place
    return following


def _has_numbers(row: Row) -> bool:
    return sum(map(looks_like_number, row.filled)) > 1


def _is_numbers(row: Row) -> bool:
    cells = row.filled
    return len(cells) > 1 and all(looks_like_number(cell) for cell in cells)


def _refuse_numbers_above(grid: Grid, above: Sequence[Row], width: int) -> None:
    stray = next((row for row in above if _is_numbers(row) and len(row.cells) == width), None)
    if stray is not None:
        raise InputError(
            f"{grid.place(stray.line)}: a row of numbers stands above the names of the columns; "
            "put the names above all rows"
        )


def _side_by_side(block: Block) -> list[Block]:
    """Return a block for each specimen where the same names come again to the right."""
    texts = {column: title.text for column, title in block.titles.items() if title.text}
    first_text = next(iter(texts.values()))
    starts = [column for column, text in texts.items() if text == first_text]
    length = starts[1] - starts[0] if len(starts) > 1 else 0
    kinds = {
        title.quantity for column, title in block.titles.items() if starts[0] <= column < starts[0] + length
    }
    whole = kinds.intersection(_LOADS) and kinds.intersection(_LENGTHS)
    if not whole or any(b - a != length for a, b in pairwise(starts)):
        return [replace(block, label=_label_above(block.above))]
    found = []
    for number, start in enumerate(starts):
        span = range(start, start + length)
        label = next((text for column in span if (text := _label_at(block.above, column))), "")
        titles = {column: block.titles[column] for column in span if column in block.titles}
        found.append(replace(block, titles=titles, label=label or str(number + 1)))
    return found


def _label_at(above: Sequence[Row], column: int) -> str:
    """Return what stands above a column, where specimens stand beside each other; a row with a number is of sizes."""
    labels = [row for row in above if row.filled and not any(map(looks_like_number, row.filled))]
    return labels[-1].text(column) if labels else ""


def _label_above(above: Sequence[Row]) -> str:
    """Return a specimen's label: a line of its own such as "Specimen 2", or a fact such as "Specimen label"."""
    for row in reversed(above):
        cells = row.filled
        if (
            not cells
            or len(cells) > 2
            or not has_word(cells[0], SPECIMEN_WORDS)
            or len(cells[-1]) > _LONGEST_LABEL
        ):
            continue
        if len(cells) == 2 and has_word(cells[0], _LABEL_WORDS):
            return cells[1]
        if len(cells) == 1 and len(words_of(cells[0])) <= 3 and any(one.isdigit() for one in cells[0]):
            return cells[0]
    return ""
