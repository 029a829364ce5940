"""How a file writes its numbers: the decimal mark is settled once, by all of them.

``1,5`` has a decimal comma, ``1.5`` a decimal point, ``1.234,5`` a comma and points between thousands; ``1,234`` may be
either. A file that writes some numbers one way and some the other is refused at the line that does not fit.
"""

import math
import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from estimator.errors import InputError
from estimator.input_file import parse_number
from estimator.uniaxial.reading.cells.grid import Cell

DecimalMark = Literal["point", "comma"]
_MARKS: dict[DecimalMark, str] = {"point": ".", "comma": ","}
_GAPS = " \u00a0\u2007\u2009\u202f'\u2019"
_LOOKS = re.compile(rf"[+\-\u2212]?(\d[\d.,{_GAPS}]*|[.,]\d+)([eEdD][+-]?\d+)?\s?%?")
_NO_VALUE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_PARTS = re.compile(r"([+-]?)([^eEdD]*)((?:[eEdD].*)?)", re.DOTALL)
_FORTRAN = str.maketrans("dD", "ee")  # its exponents of double precision
_THOUSAND = 3
_MANY_WHOLE = 3
_LONGEST = 400


def looks_like_number(cell: Cell) -> bool:
    """Tell whether a cell is a number in some way of writing."""
    if isinstance(cell, float):
        return True
    return len(cell) <= _LONGEST and bool(_LOOKS.fullmatch(cell) or _NO_VALUE.fullmatch(cell))


def rough_number(cell: str) -> float:
    """Return a number of a file whose decimal mark is not settled yet; NaN where it is none that can be told."""
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return float("nan")


@dataclass(frozen=True, slots=True)
class NumberStyle:
    """The decimal mark of a file."""

    mark: DecimalMark

    def parse(self, cell: Cell) -> float:
        """Return the number that a cell is; a percent sign behind it is passed over.

        Raises
        ------
        ValueError
            It is none in this style, or not finite.
        """
        value = parse_number(repr(cell) if isinstance(cell, float) else self._plain(cell))
        if not math.isfinite(value):
            raise ValueError(f"{cell!r} is not finite")
        return value

    def _plain(self, text: str) -> str:
        bare = text.replace("\u2212", "-").removesuffix("%").strip()
        sign, mantissa, exponent = _PARTS.fullmatch(bare).groups()  # type: ignore[union-attr] # matches any text
        decimal = _MARKS[self.mark]
        whole, mark, fraction = mantissa.partition(decimal)
        separators = {one for one in whole if one in f".,{_GAPS}"}
        if separators:
            if len(separators) > 1:
                raise ValueError(f"{text!r} is no number")
            groups = whole.split(separators.pop())
            if not 1 <= len(groups[0]) <= _THOUSAND or any(len(group) != _THOUSAND for group in groups[1:]):
                raise ValueError(f"{text!r} has no groups of three digits")
            whole = "".join(groups)
        return f"{sign}{whole}{'.' if mark else ''}{fraction}{exponent.translate(_FORTRAN)}"


def settle(cells: Iterable[tuple[str, int, Cell]], separator: str) -> NumberStyle:
    """Settle the decimal mark by all numbers of a table.

    Parameters
    ----------
    cells : where each stands, as a message names it, its column, and the cell
    separator : of the columns

    Raises
    ------
    InputError
        Some have a decimal comma and some a point, or some could be read either way.
    """
    first: dict[DecimalMark, tuple[str, str]] = {}
    columns: dict[int, _Column] = defaultdict(_Column)
    for where, place, cell in cells:
        if isinstance(cell, float) or not _LOOKS.fullmatch(cell[:_LONGEST]):
            continue
        column, mark = columns[place], _mark_of(cell)
        if mark is not None:
            column.certain = True
            first.setdefault(mark, (where, cell))
            if len(first) > 1:
                (before, other), (there, shown) = first["comma" if mark == "point" else "point"], first[mark]
                raise InputError(
                    f"{there}: {shown!r} has a decimal {mark}, and {other!r} ({_line_of(before)}) has not; "
                    "write all numbers one way"
                )
        elif "," in cell or "." in cell:
            column.open = column.open or (where, cell)
        else:
            column.whole += 1
    for column in columns.values():
        if column.open and not column.certain:
            _refuse_if_either(column, next(iter(first), None), separator)
    if first:
        return NumberStyle(next(iter(first)))
    return NumberStyle(
        "comma" if any("," in column.open[1] for column in columns.values() if column.open) else "point"
    )


@dataclass(slots=True)
class _Column:
    """What the numbers of a column tell: whether one is certain, one that is not, how many are whole."""

    certain: bool = False
    open: tuple[str, str] | None = None
    whole: int = 0


def _refuse_if_either(column: _Column, mark: DecimalMark | None, separator: str) -> None:
    """Refuse a column in which ``1.234`` may be a thousand: beside whole numbers, or quoted between commas."""
    assert column.open is not None
    where, cell = column.open
    its_mark = "comma" if "," in cell else "point"
    if mark is not None and mark != its_mark:
        return
    if column.whole >= _MANY_WHOLE or (mark is None and its_mark == "comma" and separator == ","):
        raise InputError(
            f"{where}: {cell!r} may have a decimal {its_mark} or a {its_mark} between thousands; "
            "add --decimal comma or --decimal point"
        )


def _line_of(where: str) -> str:
    return where.rpartition(": ")[2].rpartition(", ")[2]


def _mark_of(text: str) -> DecimalMark | None:
    """Return the decimal mark that a number has for certain; None where it has none, or it may part thousands."""
    mantissa = re.split(r"[eEdD%]", text.lstrip("+-\u2212"))[0].strip()
    places = [(mantissa.rfind(","), "comma"), (mantissa.rfind("."), "point")]
    commas, points = mantissa.count(","), mantissa.count(".")
    if commas and points:
        mark: DecimalMark = "comma" if max(places)[1] == "comma" else "point"
        return mark if mantissa.count(_MARKS[mark]) == 1 else None
    if commas + points != 1:
        # several of one kind part thousands, so the other is the decimal mark
        return None if not commas + points else ("point" if commas else "comma")
    whole, fraction = re.split(r"[.,]", mantissa)
    if len(fraction) == _THOUSAND and 1 <= len(whole) <= _THOUSAND and not whole.startswith("0"):
        return None
    return "comma" if commas else "point"
