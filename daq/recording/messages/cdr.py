"""ROS 2 messages of fixed layout as numpy records, so that a block of samples is packed by one array operation.

A message on the wire is the four bytes of the encapsulation header (little-endian CDR) and the body, in which every
primitive is aligned to its own size, counted from the start of the body (OMG CDR 9.3). Where all strings of a message
are constants, every field has a fixed offset and the message *is* a record of a structured array.
"""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

ENCAPSULATION = b"\x00\x01\x00\x00"


@dataclass(slots=True)
class CdrLayout:
    """Builds the record of one message, field by field in the order of its schema.

    ``dtype`` has one named field for every primitive given by :meth:`add`; ``template`` is the message with its
    constants filled in and everything else zero.
    """

    _names: list[str] = field(default_factory=list)
    _formats: list[str] = field(default_factory=list)
    _offsets: list[int] = field(default_factory=list)
    _constants: list[tuple[int, bytes]] = field(default_factory=lambda: [(0, ENCAPSULATION)])
    _end: int = len(ENCAPSULATION)

    def add(self, name: str, kind: str, count: int = 1) -> Self:
        """Append ``count`` primitives of a numpy type such as ``"<f8"`` under one name."""
        size = np.dtype(kind).itemsize
        self._align(size)
        self._names.append(name)
        self._formats.append(kind if count == 1 else f"({count},){kind}")
        self._offsets.append(self._end)
        self._end += size * count
        return self

    def length(self, count: int) -> Self:
        """Append the constant length of a sequence."""
        self._align(4)
        return self._constant(count.to_bytes(4, "little"))

    def string(self, text: str) -> Self:
        """Append a constant string."""
        data = text.encode() + b"\0"
        return self.length(len(data))._constant(data)

    def header(self, frame_id: str) -> Self:
        """Append a ``std_msgs/Header`` with fields ``sec`` and ``nanosec`` and a constant frame."""
        return self.add("sec", "<i4").add("nanosec", "<u4").string(frame_id)

    @property
    def dtype(self) -> np.dtype[np.void]:
        """The record of the whole message, encapsulation header included."""
        return np.dtype(
            {
                "names": self._names,
                "formats": self._formats,
                "offsets": self._offsets,
                "itemsize": self._end,
            }
        )

    @property
    def template(self) -> bytes:
        """The whole message with its constants filled in and every field zero."""
        data = bytearray(self._end)
        for offset, constant in self._constants:
            data[offset : offset + len(constant)] = constant
        return bytes(data)

    def _align(self, size: int) -> None:
        body = self._end - len(ENCAPSULATION)
        self._end += -body % size

    def _constant(self, data: bytes) -> Self:
        self._constants.append((self._end, data))
        self._end += len(data)
        return self
