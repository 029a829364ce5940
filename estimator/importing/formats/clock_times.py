"""Stamps of a clock, with their date or without, as seconds from the first of them."""

import re
from collections.abc import Sequence
from datetime import UTC, date, datetime, timedelta

import numpy as np

from estimator.importing.table import FloatArray

_CLOCK = re.compile(r"(?:(\S+)[ T])?(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)\s*([AaPp][Mm])?")
_OF_A_SHEET = "time "  # that the reader of spreadsheets puts before a stamp
_DAY_S = 86400.0
_MOST_MISSING = 0.1
_LONGEST = 64


def seconds_of_stamps(cells: Sequence[str]) -> FloatArray | None:
    """Return seconds since the first stamp, NaN where a cell is none; None where they are no stamps or all the same.

    Dates are those of ISO 8601; of another date, which may be read in two ways, only the clock is used, and only where
    all rows are of one day. A clock without a date runs on past midnight.

    Examples
    --------
    >>> seconds_of_stamps(["23:59:59.5", "00:00:00.0", "00:00:01.0"]).tolist()
    [0.0, 0.5, 1.5]
    >>> seconds_of_stamps(["2024-03-01T10:00:00.25", "", "2024-03-01T10:00:01Z"]) is None
    True
    >>> seconds_of_stamps(["2024-03-01T10:00:00.25Z", "2024-03-02T10:00:00.25Z"]).tolist()
    [0.0, 86400.0]
    """
    known = [cell.removeprefix(_OF_A_SHEET).strip() for cell in cells]
    if sum(not cell for cell in known) > _MOST_MISSING * len(known):
        return None
    read = [_stamp(cell) for cell in known]
    if any(one is None for one, cell in zip(read, known, strict=True) if cell):
        return None
    days = {day for one in read if one is not None for day in one[:1]}
    seconds = np.array([np.nan if one is None else one[1] for one in read])
    first = seconds[np.isfinite(seconds)][:1]
    if not len(first) or len(set(known)) == 1:
        return None
    if len(days) == 1:
        return _past_midnight(seconds - first) if days == {None} else np.asarray(seconds - first)
    if not all(isinstance(day, date) for day in days):
        return None
    origin = min(day for day in days if isinstance(day, date))
    whole = [
        np.nan if one is None or not isinstance(one[0], date) else (one[0] - origin).days * _DAY_S
        for one in read
    ]
    total = seconds + np.array(whole)
    return np.asarray(total - total[np.isfinite(total)][0])


def _stamp(cell: str) -> tuple[date | str | None, float] | None:
    """Return the day, a text where it is no date of ISO 8601 and None where there is none, and its seconds."""
    if len(cell) > _LONGEST:
        return None
    try:
        moment = datetime.fromisoformat(cell) if "-" in cell[:8] else None
    except ValueError:
        moment = None
    if moment is not None:
        if moment.tzinfo is not None:
            moment = moment.astimezone(UTC)
        begin = moment.replace(hour=0, minute=0, second=0, microsecond=0)
        return moment.date(), (moment - begin) / timedelta(seconds=1)
    match = _CLOCK.fullmatch(cell)
    if match is None or int(match[3]) > 59:
        return None
    hour = int(match[2])
    if match[5]:
        hour = hour % 12 + (12 if match[5].lower() == "pm" else 0)
    return match[1], 3600.0 * hour + 60.0 * int(match[3]) + float(match[4].replace(",", "."))


def _past_midnight(seconds: FloatArray) -> FloatArray:
    known = np.isfinite(seconds)
    kept = seconds[known]
    days = np.cumsum(np.diff(kept, prepend=kept[:1]) < -_DAY_S / 2)
    found = seconds.copy()
    found[known] = kept + _DAY_S * days
    return found
