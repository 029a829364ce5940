"""Which columns of a table are used: engineering before true, stress and strain before load and travel."""

from collections.abc import Sequence
from dataclasses import dataclass

from estimator.errors import InputError
from estimator.uniaxial.reading.language.titles import Title
from estimator.uniaxial.reading.language.vocabulary import Quantity
from estimator.uniaxial.reading.tables.blocks import Block

ABSCISSAE: tuple[Quantity, ...] = ("strain", "extension", "height", "position")
ORDINATES: tuple[Quantity, ...] = ("stress", "force")


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
    """Return the column of a kind, engineering or true; None where the table has none."""
    candidates = [
        (column, title)
        for column, title in block.titles.items()
        if title.quantity == kind and title.true == true
    ]
    if not candidates:
        return None
    column, title = next(((c, t) for c, t in candidates if t.nominal), candidates[0])
    return Choice(column, title, tuple(t.text for c, t in candidates if c != column))
