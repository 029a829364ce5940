"""The first loading of a test: up to the first reversal of strain, without holds, or up to the fall of stress.

A test may go back and forth, wait, or go on when the specimen is torn. What counts as a reversal or a fall is measured
in the noise of the data, told from their third differences, in which a smooth curve all but vanishes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.uniaxial.records import FloatArray

_IN_NOISE = 8.0
_LEAST_REVERSAL = 1e-3  # of the range of strain; a smaller one moves no modulus
_LEAST_FALL = 0.1  # of the largest stress before it
_DIRECTION = 0.05  # of the range of strain: an excursion that tells where the test goes
_HOLD_ROWS = 8
_HOLD_SLOWNESS = 5.0
_RATE_WINDOW = 5
_FEWEST_MOVING = 12
_FEWEST_LOADED = 6
_NOISY_BEGINNING = (
    0.03  # of the range of strain: a fall of stress up to there, with far more to come, is no tear
)
_FAR_MORE = 4.0

IndexArray = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Loading:
    """Rows of the first loading.

    Attributes
    ----------
    rows : (k,) their places among all rows
    strain_sign, stress_sign : the signs that the file gives to loading
    waiting : (m,) places of rows before the test moves
    left_out : which rows are missing, and why
    torn_at : place of the last row before stress falls, among all rows; None where it does not
    """

    rows: IndexArray
    strain_sign: float
    stress_sign: float
    waiting: IndexArray
    left_out: tuple[str, ...]
    torn_at: int | None = None


def noise_of(values: FloatArray) -> float:
    """Return the standard deviation of noise on a smooth course, robust against single jumps."""
    if len(values) < _HOLD_ROWS:
        return 0.0
    return float(1.4826 * np.median(np.abs(np.diff(values, 3))) / np.sqrt(20))


def first_loading(strain: FloatArray, stress: FloatArray, lines: IndexArray) -> Loading:
    """Find the first loading.

    Parameters
    ----------
    strain, stress : (n,) with the signs of the file, in the order in which they were measured
    lines : (n,) where they stand, to tell what is left out
    """
    strain_sign = _direction(strain)
    begin = _departure(strain_sign * (strain - strain[0]), stress)
    if begin:
        rest = first_loading(strain[begin:], stress[begin:], lines[begin:])
        return replace(
            rest,
            rows=rest.rows + begin,
            torn_at=None if rest.torn_at is None else rest.torn_at + begin,
            waiting=np.concatenate([np.arange(begin), rest.waiting + begin]),
            left_out=(f"{lines_told(lines[:begin])}: before the test moves off", *rest.left_out),
        )
    course = strain_sign * (strain - strain[0])
    turn = _first_reversal(course)
    stress_sign = _sign_of(stress[: turn + 1])
    load = stress_sign * stress
    left_out = []
    if turn + 1 < len(course):
        left_out.append(
            f"{lines_told(lines[turn + 1 :])}: behind the first reversal, at a strain of {abs(strain[turn]):.3g}"
        )
    resting = _holds(course[: turn + 1], load[: turn + 1])
    kept, waiting, told = _without_holds(course[: turn + 1], resting, lines)
    left_out.extend(told)
    torn = _fall(load[kept], course[kept])
    if torn is not None:
        peak, fallen = torn
        behind = kept[peak + 1 :]
        left_out.append(
            f"{lines_told(lines[behind])}: behind the fall of stress by {round(100 * fallen)} %, "
            f"at a strain of {abs(strain[kept[peak]]):.3g}"
        )
        kept = kept[: peak + 1]
    torn_at = None if torn is None else int(kept[-1])
    return Loading(kept, strain_sign, stress_sign, waiting, tuple(left_out), torn_at)


def runs_backwards(strain: FloatArray, stress: FloatArray, time: FloatArray | None) -> bool:
    """Tell whether the rows stand from the last to the first: time falls, or without one, all of strain and stress."""
    if time is not None and len(time) > 1 and time[0] != time[-1]:
        return bool(np.all(np.diff(time) <= 0))
    size = np.abs(strain)
    reach = float(size.max(initial=0.0))
    if reach == 0 or size[0] < 0.9 * reach or size[-1] > 0.1 * reach or abs(stress[0]) <= abs(stress[-1]):
        return False
    least = max(_IN_NOISE * noise_of(size), _LEAST_REVERSAL * reach)
    return bool(np.all(np.diff(_median3(size)) <= least))


def _direction(strain: FloatArray) -> float:
    away = strain - strain[0]
    reach = float(np.abs(away).max(initial=0.0))
    far = np.flatnonzero(np.abs(_median3(away)) > _DIRECTION * reach)
    return -1.0 if len(far) and away[far[0]] < 0 else 1.0


def _departure(course: FloatArray, stress: FloatArray) -> int:
    """Return the place from which on a test goes off that first goes to and fro, without loading; 0 for all others."""
    reach = float(course.max(initial=0.0))
    gone = np.flatnonzero(_median3(course) > _DIRECTION * reach)
    turn = _first_reversal(course)
    if not len(gone) or turn >= gone[0] or np.abs(course[: gone[0]]).max() > _DIRECTION * reach:
        return 0
    risen = float(np.abs(stress[turn] - stress[0]))
    if turn >= _FEWEST_LOADED and risen > max(6 * noise_of(stress), 0.01 * float(np.ptp(stress))):
        return 0
    smooth = _median3(course)[: gone[0]]
    farthest = np.maximum.accumulate(smooth)
    back = int(np.flatnonzero(farthest - smooth > _least_reversal(course))[-1])
    return back + int(np.argmax(np.append(smooth[back:] >= farthest[back], True)))


def _sign_of(stress: FloatArray) -> float:
    """Return the sign of the largest stress, from where it starts; what a torn specimen bears later is less."""
    away = _median3(stress) - np.median(stress[:3])
    return -1.0 if away[int(np.argmax(np.abs(away)))] < 0 else 1.0


def _first_reversal(course: FloatArray) -> int:
    """Return the place of the largest strain before it first falls by more than noise; the last where it never does."""
    smooth = _median3(course)
    fallen = np.maximum.accumulate(smooth) - smooth
    reversed_at = np.flatnonzero(fallen > _least_reversal(course))
    if not len(reversed_at):
        return len(course) - 1
    peak = int(np.argmax(smooth[: int(reversed_at[0]) + 1]))
    # the median cuts a peak of one row, which is the turning point itself where the step to it is no glitch
    usual = float(np.abs(np.diff(course[max(peak - _RATE_WINDOW, 0) : peak + 1])).max(initial=0.0))
    if peak + 1 < len(course) and 0 < course[peak + 1] - course[peak] <= 2 * usual:
        peak += 1
    return peak


def _least_reversal(course: FloatArray) -> float:
    return max(_IN_NOISE * noise_of(course), _LEAST_REVERSAL * float(np.ptp(course)))


def _holds(course: FloatArray, load: FloatArray) -> list[tuple[int, int]]:
    """Return first and last row of every stretch in which strain rests and stress does not rise."""
    if len(course) <= _HOLD_ROWS + _RATE_WINDOW:
        return []
    rates = np.abs(course[_RATE_WINDOW:] - course[:-_RATE_WINDOW]) / _RATE_WINDOW
    rate = float(np.sum(rates**2) / np.sum(rates)) if rates.any() else 0.0
    if rate == 0:
        return []
    band = max(6 * noise_of(course), 0.5 * rate)
    shortest = max(_HOLD_ROWS, int(np.ceil(_HOLD_SLOWNESS * band / rate)))
    rise = 4 * noise_of(load) + float(np.ptp(load)) / float(np.ptp(course)) * band
    found = []
    begin = 0
    while begin + shortest <= len(course):
        if np.ptp(course[begin : begin + shortest]) > band:
            begin += 1
            continue
        end = _extended(course, begin, begin + shortest - 1, band)
        third = max((end - begin + 1) // 3, 1)
        if load[end - third + 1 : end + 1].mean() - load[begin : begin + third].mean() <= rise:
            found.append((begin, end))
        begin = end + 1
    return found


def _extended(course: FloatArray, begin: int, end: int, band: float) -> int:
    low, high = float(course[begin : end + 1].min()), float(course[begin : end + 1].max())
    while end + 1 < len(course):
        low, high = min(low, float(course[end + 1])), max(high, float(course[end + 1]))
        if high - low > band:
            break
        end += 1
    return end


def _without_holds(
    course: FloatArray, holds: Sequence[tuple[int, int]], lines: IndexArray
) -> tuple[IndexArray, IndexArray, list[str]]:
    """Return the rows that move, those before the first of them, and what was left out."""
    every = np.arange(len(course))
    moving = np.ones(len(course), dtype=bool)
    for begin, end in holds:
        moving[begin + 1 : end + 1] = False
    waiting, told = np.empty(0, dtype=np.intp), []
    if holds and holds[0][0] == 0:
        begin, end = holds[0]
        waiting = every[: end + 1]
        moving[begin], moving[end] = False, True
        told.append(f"{lines_told(lines[:end])}: before the test moves")
        holds = holds[1:]
    if holds and moving.sum() < _FEWEST_MOVING <= len(course) - len(waiting):
        for begin, end in holds:
            moving[begin : end + 1] = True
        return every[moving], waiting, told
    if holds:
        shown = ", ".join(lines_told(lines[begin + 1 : end + 1]) for begin, end in holds[:3])
        more = f" and {len(holds) - 3} more" if len(holds) > 3 else ""
        told.append(f"{shown}{more}: the test rests; the first row of each rest is kept")
    return every[moving], waiting, told


def _fall(load: FloatArray, course: FloatArray) -> tuple[int, float] | None:
    """Return the place of the largest stress before it first falls by more than noise, and by which share."""
    smooth = _median3(load)
    peak = np.maximum.accumulate(smooth)
    fallen = peak - smooth
    torn = np.flatnonzero((fallen > _LEAST_FALL * np.abs(peak)) & (fallen > _IN_NOISE * noise_of(load)))
    torn = torn[peak[torn] > 0.02 * float(smooth.max(initial=0.0))]
    if not len(torn):
        return None
    # noise while the test begins
    peak_at = np.maximum.accumulate(np.where(smooth == peak, np.arange(len(smooth)), 0))
    early = (course - course[:1])[peak_at] <= _NOISY_BEGINNING * float(np.ptp(course))
    later = np.maximum.accumulate(smooth[::-1])[::-1]
    torn = torn[~(early[torn] & (later[torn] > _FAR_MORE * peak[torn]))]
    if not len(torn):
        return None
    place = int(np.argmax(smooth[: torn[0]]))
    while place + 1 < torn[0] and load[place + 1] > load[place]:
        place += 1
    lowest = float(smooth[place:].min())
    return place, float((load[place] - lowest) / load[place])


def _median3(values: FloatArray) -> FloatArray:
    if len(values) < 3:
        return values
    padded = np.concatenate([values[:1], values, values[-1:]])
    return np.asarray(np.median(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0))


def lines_told(lines: IndexArray) -> str:
    """Return lines in words: the first and the last of them."""
    if len(lines) == 1:
        return f"line {lines[0]}"
    return f"lines {lines[0]} to {lines[-1]}"
