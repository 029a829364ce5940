"""What a file states above its table: facts as text, the specimen's sizes, and the kind of test."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from estimator.errors import InputError
from estimator.uniaxial.reading.cells.grid import Grid, Row
from estimator.uniaxial.reading.cells.numbers import NumberStyle, looks_like_number
from estimator.uniaxial.reading.language.titles import mode_in
from estimator.uniaxial.reading.language.units import dimension_of, shown, spelt
from estimator.uniaxial.reading.language.vocabulary import (
    MODE_STANDARDS,
    NOT_SIZE_WORDS,
    SIZE_WORDS,
    TEST_KIND_WORDS,
    UNITS,
    Size,
)
from estimator.uniaxial.reading.language.words import first_word, has_word, words_of
from estimator.uniaxial.records import Mode

_NO_FACTS = ("parameter", "parameters", "name", "key word", "keyword")
_BRACKETS = re.compile(r"[(\[]([^()\[\]]*)[)\]]")
_NUMBER_AND_UNIT = re.compile(r"([+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s*(\S?.*)")
_ROWS_BELOW = 3
_THOUSAND = 3
_MOST_WORDS = 9


@dataclass(frozen=True, slots=True)
class SizeFact:
    """A size of the specimen as a file states it: in SI, None where its unit is missing."""

    size: Size
    rank: int
    text: str
    value: float | None


def facts_of(rows: Sequence[Row]) -> dict[str, str]:
    """Return the facts as text: the first cell, or what stands before a colon, names the rest."""
    facts: dict[str, str] = {}
    for row in rows:
        cells = row.filled
        if not cells:
            continue
        key, value = cells[0], cells[1] if len(cells) > 1 else ""
        if not value:
            key, _, value = key.rstrip(";").partition(":")
        key, value = key.strip().rstrip(":").strip(), value.strip()
        if key and value and key.lower() not in _NO_FACTS:
            facts.setdefault(key, value)
    return facts


def mode_of_facts(rows: Sequence[Row]) -> tuple[Mode, str] | None:
    """Return the kind of test that lines above the table speak of, and the line; None where none or several do."""
    told: dict[Mode, str] = {}
    for row, below in pairwise([*rows, Row(0, ())]):
        cells = row.filled
        text = " ".join(cells)
        if len(words_of(text)) > 2 * _MOST_WORDS:
            pass
        elif mode := _standard_in(text) or (mode_in(text) if has_word(text, TEST_KIND_WORDS) else None):
            told.setdefault(mode, ": ".join(cells[:2]))
        for column in range(1, len(row.cells)):
            # facts that stand below their names
            if has_word(row.text(column), TEST_KIND_WORDS) and (mode := mode_in(below.text(column))):
                told.setdefault(mode, f"{row.text(column)}: {below.text(column)}")
    return next(iter(told.items())) if len(told) == 1 else None


def speaks_of_test(row: Row) -> bool:
    """Tell whether a line above the table speaks of the kind of test."""
    text = " ".join(row.filled)
    return len(words_of(text)) <= 2 * _MOST_WORDS and has_word(text, TEST_KIND_WORDS)


def _standard_in(text: str) -> Mode | None:
    modes: tuple[Mode, ...] = ("compression", "tension")
    found = [mode for mode in modes if has_word(text.replace("EN ", ""), MODE_STANDARDS[mode])]
    return found[0] if len(found) == 1 else None


def sizes_of(
    grid: Grid, rows: Sequence[Row], style: NumberStyle, specimen: int, columns: range
) -> Mapping[Size, SizeFact]:
    """Return the specimen's sizes.

    Parameters
    ----------
    specimen : place among the specimens of the file, where sizes have a row or a column for each
    columns : of the specimen's table; what stands above them goes first

    Raises
    ------
    InputError
        A size is stated as something that is no positive number.
    """
    best: dict[Size, tuple[bool, int, SizeFact]] = {}
    for column, fact in _size_facts(grid, rows, style, specimen):
        found = (column not in columns, fact.rank, fact)
        if fact.size not in best or found[:2] < best[fact.size][:2]:
            best[fact.size] = found
    return {size: fact for size, (_, _, fact) in best.items()}


def _size_facts(
    grid: Grid, rows: Sequence[Row], style: NumberStyle, specimen: int
) -> Iterator[tuple[int, SizeFact]]:
    """Yield the column and the size of every cell that names one."""
    for place, row in enumerate(rows):
        for column in range(len(row.cells)):
            key, inside = _key_of(row.text(column))
            named = _size_named(key)
            if named is None:
                continue
            size, rank = named
            in_key = next((u for u in _BRACKETS.findall(key) if _measures(u, size)), None)
            found, unit = _value_of(inside), row.text(column + 1)
            if found is None:
                found, unit = _beside(row, column + 1, specimen)
            if found is None:
                found, unit = _below(rows[place + 1 : place + 2 + _ROWS_BELOW + specimen], column, specimen)
            if found is None:
                continue
            number, own_unit = found
            yield (
                column,
                SizeFact(
                    size,
                    rank,
                    f"{key.strip()} {number} {own_unit or in_key or unit}".strip(),
                    _in_si(grid.place(row.line), key, number, [own_unit, in_key or "", unit], size, style),
                ),
            )


def _key_of(text: str) -> tuple[str, str]:
    """Part a cell such as ``Cylinder height: 30mm;`` at its last colon where a number follows it."""
    key, mark, value = text.rstrip("; ").replace("=", ":").rpartition(":")
    return (key, value.strip()) if mark and _value_of(value) else (text, "")


def _size_named(key: str) -> tuple[Size, int] | None:
    bare = _BRACKETS.sub(lambda found: "" if dimension_of(found[1]) else found[0], key)
    if not bare.strip() or len(words_of(bare)) > _MOST_WORDS or has_word(bare, NOT_SIZE_WORDS):
        return None
    ranks = ((size, first_word(bare, words)) for size, words in SIZE_WORDS.items())
    found = [(size, rank) for size, rank in ranks if rank is not None]
    return found[0] if found else None


def _value_of(text: str) -> tuple[str, str] | None:
    """Return number and unit of a text such as ``50mm`` or ``20.0``; None where it is something else."""
    match = _NUMBER_AND_UNIT.fullmatch(text.strip())
    if match is None or not looks_like_number(match[1]):
        return None
    return (match[1], match[2]) if not match[2] or dimension_of(match[2]) else None


def _beside(row: Row, begin: int, specimen: int) -> tuple[tuple[str, str] | None, str]:
    """Return the value right of a name, one of several where there is one for each specimen, and the unit there."""
    unit, values = "", []
    for text in map(row.text, range(begin, len(row.cells))):
        if found := _value_of(text):
            values.append(found)
        elif not unit and dimension_of(text):
            unit = text
        else:
            break
    following = row.text(begin + 1) if len(values) == 1 and not unit else unit
    return (values[min(specimen, len(values) - 1)] if values else None), following


def _below(rows: Sequence[Row], column: int, specimen: int) -> tuple[tuple[str, str] | None, str]:
    """Return the value below a name, and the unit between the two, where facts stand below their names."""
    unit = ""
    values = []
    for row in rows:
        text = row.text(column)
        if dimension_of(text) and not looks_like_number(text):
            unit = unit or text
        elif found := _value_of(text):
            values.append(found)
        elif values or text:
            break
    if not values:
        return None, unit
    return values[min(specimen, len(values) - 1)], unit


def _measures(unit: str, size: Size) -> bool:
    return spelt(unit) in UNITS["area" if size == "area" else "length"]


def _in_si(
    where: str, key: str, number: str, units: Sequence[str], size: Size, style: NumberStyle
) -> float | None:
    unit = next((one for one in units if one and _measures(one, size)), None)
    foreign = next((one for one in units[:2] if one and not _measures(one, size)), None)
    if foreign is not None:
        wanted = shown("area" if size == "area" else "length")
        raise InputError(f"{where}: {foreign!r} is no unit of {key.strip()!r}; write {wanted}")
    if _either(number, style):
        raise InputError(
            f"{where}: {number!r} of {key.strip()!r} may have a decimal mark or one between thousands; "
            "write it without the one between thousands"
        )
    value = _number(number, style)
    if value is None or value < 0:
        raise InputError(f"{where}: {number!r} is no size for {key.strip()!r}; correct it")
    if value == 0 or unit is None:
        return None  # programs write 0 for a size that nobody entered
    return value * UNITS["area" if size == "area" else "length"][spelt(unit)]


def _either(text: str, style: NumberStyle) -> bool:
    """Tell whether a size may be a thousand times another: three digits behind a mark that the table has not."""
    other = "," if style.mark == "point" else "."
    whole, mark, rest = text.partition(other)
    return (
        bool(mark) and len(rest) == _THOUSAND and rest.isdigit() and 1 <= len(whole.lstrip("+0")) <= _THOUSAND
    )


def _number(text: str, style: NumberStyle) -> float | None:
    """Return a number in the table's style, else in the other; facts are often typed by hand."""
    for one in (style, NumberStyle("comma" if style.mark == "point" else "point")):
        try:
            return one.parse(text)
        except ValueError:
            continue
    return None
