"""Readings that are the instrument's and not the specimen's: single ones far off, and a load cell at its limit."""

import numpy as np
from numpy.typing import NDArray

from estimator.uniaxial.loading import IndexArray, lines_told, noise_of
from estimator.uniaxial.records import FloatArray

_IN_NOISE = 8.0
_IN_STEPS = 4.0  # of those beside it
_LEAST_GLITCH = 0.02  # of the range
_NEARBY = 3  # rows to either side
_LONG_RUN = 8  # rows with one and the same stress
_LONGER = 4.0  # than any other run of equal stress, as coarse readings have
_MOVES = 0.01  # of the range of strain
_MOST_TOLD = 3


def of_the_instrument(
    strain: FloatArray, stress: FloatArray, lines: IndexArray
) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Return which rows are readings of the instrument alone, (n,), and a sentence for each kind.

    Parameters
    ----------
    strain, stress : (n,) with the signs of the file
    lines : (n,) where they stand

    Examples
    --------
    >>> strain = np.linspace(0.0, 0.5, 26)
    >>> stress = 1e4 * strain
    >>> stress[10] = 0.0
    >>> rows, told = of_the_instrument(strain, stress, np.arange(2, 28))
    >>> np.flatnonzero(rows).tolist(), told
    ([10], ('line 12: a single reading far from those beside it',))
    """
    glitches = _glitches(strain) | _glitches(stress)
    told = []
    if glitches.any():
        shown = ", ".join(lines_told(lines[[place]]) for place in np.flatnonzero(glitches)[:_MOST_TOLD])
        more = f" and {glitches.sum() - _MOST_TOLD} more" if glitches.sum() > _MOST_TOLD else ""
        told.append(f"{shown}{more}: a single reading far from those beside it")
    rows = np.flatnonzero(~glitches)
    limited = np.zeros(len(strain), dtype=bool)
    limited[rows] = _at_a_limit(strain[rows], stress[rows])
    if limited.any():
        told.append(
            f"{lines_told(lines[limited])}: the load cell is at its limit, stress stands still to the last digit"
        )
    return glitches | limited, tuple(told)


def _glitches(values: FloatArray) -> NDArray[np.bool_]:
    """Tell which readings lie to one side of both of their neighbours, by far more than noise and the steps nearby."""
    found = np.zeros(len(values), dtype=bool)
    if len(values) <= 2 * _NEARBY:
        return found
    steps = np.diff(values)
    sizes = np.abs(steps)
    inner = np.sort(values)[1:-1]
    least = max(
        _IN_NOISE * noise_of(values),
        _LEAST_GLITCH * float(np.ptp(inner)),
        _IN_NOISE * float(sizes[sizes > 0].min(initial=np.inf)) if sizes.any() else np.inf,
    )
    away = np.minimum(sizes[:-1], sizes[1:])
    for place in np.flatnonzero((steps[:-1] * steps[1:] < 0) & (away > least)) + 1:
        before, behind = (
            sizes[max(place - 1 - _NEARBY, 0) : place - 1],
            sizes[place + 1 : place + 1 + _NEARBY],
        )
        usual = max(float(before.max(initial=0.0)), float(behind.max(initial=0.0)))
        found[place] = away[place - 1] > _IN_STEPS * usual
    return found


def _at_a_limit(strain: FloatArray, stress: FloatArray) -> NDArray[np.bool_]:
    """Tell which rows behind the first of the longest run of equal stress are at the limit of the load cell."""
    limited = np.zeros(len(stress), dtype=bool)
    begins = np.concatenate([[0], np.flatnonzero(np.diff(stress)) + 1])
    lengths = np.diff(np.append(begins, len(stress)))
    largest = int(np.argmax(np.abs(stress - stress[:1]))) if len(stress) else 0
    run = int(np.searchsorted(begins, largest, side="right")) - 1
    if run < 0 or lengths[run] < _LONG_RUN:
        return limited
    others = np.delete(lengths, run)
    rows = slice(int(begins[run]), int(begins[run] + lengths[run]))
    moves = float(np.ptp(strain[rows])) > _MOVES * float(np.ptp(strain))
    if moves and lengths[run] > _LONGER * int(others.max(initial=1)):
        limited[rows] = True
    return limited
