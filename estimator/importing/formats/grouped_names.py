"""Names of columns that stand in several rows, as motion capture writes them: markers above, and x, y, z below each."""

from collections import Counter
from collections.abc import Sequence

from estimator.uniaxial.reading.cells.grid import Row
from estimator.uniaxial.reading.cells.numbers import looks_like_number

_MOST_ROWS = 6
_NO_NAMES = {"id"}  # of a row of numbers that tell markers apart and name none


def grouped_names(names: Sequence[str], above: Sequence[Row]) -> list[str]:
    """Put before names that stand there several times what the rows above say of them, as far as that parts them.

    Parameters
    ----------
    names : of the columns, in the last row of words
    above : the rows above it, the nearest last

    Examples
    --------
    >>> markers = Row(3, ("", "", "tip", "", "", "bead 1", "", ""))
    >>> grouped_names(["Frame", "Time", "X", "Y", "Z", "X", "Y", "Z"], [markers])
    ['Frame', 'Time', 'tip.X', 'tip.Y', 'tip.Z', 'bead 1.X', 'bead 1.Y', 'bead 1.Z']
    """
    rows = [row for row in reversed(above[-_MOST_ROWS:]) if _names_groups(row)]
    parts = [[name] for name in names]
    while rows and (twice := _twice(parts)):
        row = max(rows, key=lambda one: len(_parted(_filled(one, len(names)), parts, twice)))
        rows.remove(row)
        level = _filled(row, len(names))
        if len(_parted(level, parts, twice)) == len({tuple(parts[place]) for place in twice}):
            continue
        groups = {(*parts[place][:-1], level[place]) for place in twice}
        for place in range(len(names)):
            # what stands once in a group with others is of it too, as the W of a quaternion
            own = bool(row.text(place).strip()) and (*parts[place][:-1], level[place]) in groups
            if place in twice or own:
                parts[place] = [
                    *parts[place][:-1],
                    *([level[place]] if level[place] else []),
                    parts[place][-1],
                ]
    return [".".join(each) for each in parts]


def _parted(
    level: Sequence[str], parts: Sequence[Sequence[str]], places: Sequence[int]
) -> set[tuple[str, ...]]:
    return {(level[place], *parts[place]) for place in places}


def _twice(parts: Sequence[Sequence[str]]) -> list[int]:
    counts = Counter(map(tuple, parts))
    return [place for place, each in enumerate(parts) if each[-1] and counts[tuple(each)] > 1]


def _names_groups(row: Row) -> bool:
    cells = row.filled
    named = len(cells) > 1 and not any(looks_like_number(cell) for cell in cells)
    return named and cells[0].lower() not in _NO_NAMES


def _filled(row: Row, width: int) -> list[str]:
    """Return what a row says of each column: a cell of its own, or the nearest to the left."""
    found, last = [], ""
    for place in range(width):
        last = row.text(place).strip() or last
        found.append(last)
    return found
