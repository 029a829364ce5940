"""Values of the tags of a sensor's XML pages, all of which are text."""

import math
from collections.abc import Mapping

from robot_drivers.decimal_text import decimal
from robot_drivers.errors import DeviceProtocolError


def text(tags: Mapping[str, str], tag: str) -> str:
    """Return the text of a tag.

    Raises
    ------
    DeviceProtocolError
        There is no such tag.
    """
    try:
        return tags[tag]
    except KeyError:
        raise DeviceProtocolError(
            f"the sensor's configuration has no {tag!r}: is it an ATI sensor on Ethernet? check host and HTTP port"
        ) from None


def number(tags: Mapping[str, str], tag: str) -> float:
    """Return a finite number.

    Raises
    ------
    DeviceProtocolError
        There is no such tag, or it is none.
    """
    told = text(tags, tag)
    value = decimal(told)
    if not math.isfinite(value):
        raise DeviceProtocolError(f"the sensor's {tag!r} is {told!r}: not a number")
    return value


def optional_integer(tags: Mapping[str, str], *names: str) -> int | None:
    """Return a whole number that is not negative, of the first of these tags that is there; None without.

    Raises
    ------
    DeviceProtocolError
        It is no such number.
    """
    tag = next((name for name in names if name in tags), None)
    if tag is None:
        return None
    value = number(tags, tag)
    if value != int(value) or value < 0:
        raise DeviceProtocolError(f"the sensor's {tag!r} is {tags[tag]!r}: not a whole number")
    return int(value)


def enabled(tags: Mapping[str, str], tag: str) -> bool | None:
    """Tell whether something is enabled; None where the page does not tell."""
    return tags[tag].lower() == "enabled" if tag in tags else None
