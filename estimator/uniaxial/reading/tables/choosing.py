"""Which columns of a table are used: engineering before true, stress and strain before load and travel."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from estimator.errors import InputError
from estimator.uniaxial.reading.cells.numbers import rough_number
from estimator.uniaxial.reading.language.titles import Title
from estimator.uniaxial.reading.language.vocabulary import Quantity
from estimator.uniaxial.reading.tables.blocks import Block

ABSCISSAE: tuple[Quantity, ...] = ("strain", "extension", "height", "position")
ORDINATES: tuple[Quantity, ...] = ("stress", "force")

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
        There is only true stress or strain.
    """
    for kind in kinds:
        found = column_of(block, kind)
        if found is not None:
            return found
    where, kind = block.grid.place(block.header_line), kinds[0]
    raise InputError(f"{where}: only true {kind}; give engineering {kind} (per initial size)")


def column_of(block: Block, kind: Quantity, *, true: bool = False) -> Choice | None:
    """Return the column of a kind, engineering or true, that changes; None where the table has none."""
    candidates = [
        (column, title)
        for column, title in block.titles.items()
        if title.quantity == kind and title.true == true
    ]
    if not candidates:
        return None
    live = _live(block, candidates)
    column, title = next(((c, t) for c, t in live if t.nominal), live[0])
    return Choice(column, title, tuple(t.text for c, t in candidates if c != column))


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


def _range(block: Block, column: int) -> float:
    """Return the range of a column whose decimal mark is not settled yet; 0 where it holds no numbers."""
    values = [rough_number(row.text(column)) for row in block.data]
    known = [value for value in values if math.isfinite(value)]
    return max(known) - min(known) if known else 0.0
