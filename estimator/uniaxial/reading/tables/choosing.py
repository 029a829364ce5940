"""Which columns of a table are used: engineering before true, stress and strain before load and travel.

Of channels of several axes it is the one with the largest range.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from estimator.errors import InputError
from estimator.uniaxial.reading.cells.numbers import rough_number
from estimator.uniaxial.reading.language.titles import Title
from estimator.uniaxial.reading.language.vocabulary import CORRECTED_WORDS, Measure, Quantity
from estimator.uniaxial.reading.language.words import has_word
from estimator.uniaxial.reading.tables.axes import of_several_axes
from estimator.uniaxial.reading.tables.blocks import Block

ABSCISSAE: tuple[Quantity, ...] = ("strain", "extension", "height", "position")
ORDINATES: tuple[Quantity, ...] = ("stress", "force")

_CONVERSIONS: Mapping[tuple[Quantity, Measure], str] = MappingProxyType(
    {
        ("strain", "true"): "exp(true strain) - 1",
        ("strain", "Green"): "sqrt(1 + 2 Green strain) - 1",
        ("strain", "Almansi"): "1 / sqrt(1 - 2 Almansi strain) - 1",
        ("stress", "true"): "true stress / (1 + engineering strain)",
        ("stress", "Kirchhoff"): "Kirchhoff stress / (1 + engineering strain)",
        ("stress", "second Piola-Kirchhoff"): "it times (1 + engineering strain)",
    }
)
_LOADED_TOO = 0.2  # of the largest load: more than a sensor's cross-talk and a skew grip give
_STANDS_STILL = 0.01  # range, of that of another column of the same kind


@dataclass(frozen=True, slots=True)
class Choice:
    """A column that is used, and others of its kind that are not."""

    column: int
    title: Title
    others: tuple[str, ...]

    @property
    def quantity(self) -> Quantity:
        """What the column holds."""
        assert self.title.quantity is not None
        return self.title.quantity


def choose(block: Block, kinds: Sequence[Quantity]) -> Choice:
    """Return the first column of the first kind that the table has.

    Raises
    ------
    InputError
        There is only true stress or strain, or another measure of them, or loads along two axes.
    """
    for kind in kinds:
        found = column_of(block, kind)
        if found is not None:
            if kind in ORDINATES:
                _refuse_two_loads(block, found)
            return found
    where, kind = block.grid.place(block.header_line), kinds[0]
    other = next(title for title in block.titles.values() if title.quantity == kind)
    assert other.measure is not None  # since no other column has one
    how = f": {_CONVERSIONS[kind, other.measure]}" if (kind, other.measure) in _CONVERSIONS else ""
    raise InputError(
        f"{where}: only {other.measure} {kind} ({other.text!r}); give engineering {kind} (per initial size){how}"
    )


def column_of(block: Block, kind: Quantity, measure: Measure | None = None) -> Choice | None:
    """Return the column of a kind and measure that changes, the engineering one; None where the table has none."""
    candidates = [
        (column, title)
        for column, title in block.titles.items()
        if title.quantity == kind and title.measure == measure
    ]
    if not candidates:
        return None
    # a raw signal in volts or counts beside one in newtons
    live = _live(block, [one for one in candidates if one[1].unknown_unit is None] or candidates)
    first = next((one for one in live if one[1].nominal), None) or next(
        (one for one in live if has_word(one[1].text, CORRECTED_WORDS)), live[0]
    )
    column, title = max(_of_its_axes(first, live), key=lambda one: _range(block, one[0]))
    return Choice(column, title, tuple(t.text for c, t in candidates if c != column))


def _of_its_axes(
    first: tuple[int, Title], candidates: Sequence[tuple[int, Title]]
) -> Sequence[tuple[int, Title]]:
    """Return a column and those in the same unit that are the same along other axes."""
    alike = [first, *(one for one in candidates if one != first and one[1].unit == first[1].unit)]
    return [alike[place] for place in of_several_axes([title.text for _, title in alike])]


def _refuse_two_loads(block: Block, choice: Choice) -> None:
    """Refuse loads along two axes, as those of a biaxial test."""
    used = (choice.column, choice.title)
    others = [
        one for one in block.titles.items() if one[1].quantity == choice.quantity and one[0] != choice.column
    ]
    for column, title in _of_its_axes(used, others)[1:]:
        share = _share_of(block, choice.column, column)
        if share >= _LOADED_TOO:
            raise InputError(
                f"{block.grid.place(block.header_line)}: {title.text!r} bears {100 * share:.0f} % of what "
                f"{choice.title.text!r} does, so that the specimen is loaded along two axes; a uniaxial test has one, "
                "delete the column if it is another specimen's"
            )


def _live(block: Block, candidates: Sequence[tuple[int, Title]]) -> Sequence[tuple[int, Title]]:
    """Return the columns without those that stand still while another in the same unit moves: unused channels."""
    if len(candidates) == 1:
        return candidates
    ranges = [_range(block, column) for column, _ in candidates]
    return [
        one
        for one, mine in zip(candidates, ranges, strict=True)
        if mine
        >= _STANDS_STILL
        * max(r for (_, title), r in zip(candidates, ranges, strict=True) if title.unit == one[1].unit)
    ]


def _share_of(block: Block, main: int, other: int) -> float:
    """Return which share of a column another follows: the slope of its regression, on which noise has no say."""
    pairs = np.array([[rough_number(row.text(column)) for column in (main, other)] for row in block.data])
    known = pairs[np.isfinite(pairs).all(axis=1)]
    if len(known) < 2 or np.ptp(known[:, 0]) == 0:
        return 0.0
    x, y = (known - known.mean(axis=0)).T
    return abs(float(x @ y) / float(x @ x))


def _range(block: Block, column: int) -> float:
    """Return the range of a column whose decimal mark is not settled yet; 0 where it holds no numbers."""
    values = [rough_number(row.text(column)) for row in block.data]
    known = [value for value in values if math.isfinite(value)]
    return max(known) - min(known) if known else 0.0
