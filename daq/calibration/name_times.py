"""The time that stands in the name of an image: of a calendar, since 1970, or in seconds with a fraction."""

import re
from datetime import UTC, datetime

_CALENDAR = re.compile(
    r"(?<!\d)((?:19|20)\d\d)[-_.]?(\d\d)[-_.]?(\d\d)[T _-]?(\d\d)[-_:.h]?(\d\d)[-_:.m]?(\d\d)"
    r"(?:[._,-]?(\d{3}|\d{6}|\d{9}))?(?!\d)"
)
_SINCE_1970 = re.compile(r"(?<!\d)(?:(\d{10})(?:[._](\d{3,9}))?|(\d{13})|(\d{16})|(\d{19}))(?!\d)")
_SECONDS = re.compile(r"(?<![\d.])(\d{1,9})\.(\d{3,9})(?!\d)")
_PLAUSIBLE_NS = (10**18, 4 * 10**18)  # 2001 to 2096


def time_in_name_ns(rest: str) -> int | None:
    """Return the time that a name holds, ns; None where it holds none."""
    if match := _CALENDAR.search(rest):
        try:
            moment = datetime(*map(int, match.groups()[:6]), tzinfo=UTC)  # type: ignore[misc, arg-type] # six numbers
        except ValueError:
            return None
        return int(moment.timestamp()) * 10**9 + _fraction_ns(match.group(7))
    if match := _SINCE_1970.search(rest):
        seconds, fraction, ms, us, ns = match.groups()
        found = (
            int(seconds) * 10**9 + _fraction_ns(fraction)
            if seconds
            else int(ms or us or ns) * 10 ** (6 if ms else 3 if us else 0)
        )
        return found if _PLAUSIBLE_NS[0] <= found < _PLAUSIBLE_NS[1] else None
    if match := _SECONDS.search(rest):
        return int(match.group(1)) * 10**9 + _fraction_ns(match.group(2))
    return None


def _fraction_ns(digits: str | None) -> int:
    return int((digits or "0").ljust(9, "0"))
