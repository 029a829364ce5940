"""What a stream of a bag is: columns of numbers, and the stamps of their rows as the bag has them."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from robot_drivers.protocols import FloatArray, IntArray

Stamped: TypeAlias = Iterable[tuple[int, Any]]
"""Messages with the times of their receipt, ns."""

NO_STAMP = 0
"""``header.stamp`` of a message that was not stamped, ns."""


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """One stream.

    Attributes
    ----------
    name : of the topic, or of one of the streams that a topic carries
    type_name : of the messages
    log_time_ns : (n,) when they were received
    header_time_ns : (n,) ``header.stamp``, :data:`NO_STAMP` where there is none
    columns : name, unit and values (n,) of each
    frame : that the values are stated in, ``header.frame_id`` of the first
    facts : what else the messages say
    """

    name: str
    type_name: str
    log_time_ns: IntArray
    header_time_ns: IntArray
    columns: tuple[tuple[str, str | None, FloatArray], ...]
    frame: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """Number of messages."""
        return len(self.log_time_ns)


def stamp_ns(message: Any) -> int:
    """Return ``header.stamp`` of a message, ns; :data:`NO_STAMP` where it has no header."""
    stamp = getattr(_header_of(message), "stamp", None)
    return NO_STAMP if stamp is None else int(stamp.sec) * 10**9 + int(stamp.nanosec)


def frame_of(message: Any) -> str:
    """Return ``header.frame_id`` of a message, empty where it has no header."""
    return str(getattr(_header_of(message), "frame_id", ""))


def _header_of(message: Any) -> Any:
    """Return the header of a message, of markers that of the first; None where there is none."""
    if getattr(message, "markers", None):
        return message.markers[0].header
    return getattr(message, "header", None)


class Stamps:
    """Gathers the stamps of messages as they are gone through."""

    def __init__(self) -> None:
        self._log: list[int] = []
        self._header: list[int] = []
        self.frame = ""

    def through(self, messages: Stamped) -> Iterator[Any]:
        """Yield the messages, and keep their stamps."""
        for log_time_ns, message in messages:
            if not self._log:
                self.frame = frame_of(message)
            self._log.append(log_time_ns)
            self._header.append(stamp_ns(message))
            yield message

    @property
    def log_time_ns(self) -> IntArray:
        """When the messages were received (n,)."""
        return np.array(self._log, np.int64)

    @property
    def header_time_ns(self) -> IntArray:
        """Their own stamps (n,)."""
        return np.array(self._header, np.int64)
