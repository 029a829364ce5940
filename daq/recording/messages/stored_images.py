"""The images in a recording: ``CompressedImage`` and ``Image`` messages taken apart."""

import math
import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.recording.messages import codec
from daq.recording.messages.cdr import ENCAPSULATION
from daq.recording.messages.rows import RECORD

_UINT32 = struct.Struct("<I")
_SEQUENCE = struct.Struct("<I")
_STAMP_SIZE = 8


@dataclass(frozen=True, slots=True)
class StoredImage:
    """An image as it lies in the file; ``compression`` is None for a raw one, whose ``shape`` is known."""

    pixel_format: str
    compression: str | None
    data: memoryview
    shape: tuple[int, ...] = ()

    def pixels(self) -> NDArray[np.uint8] | None:
        """Return the image, None where the data are damaged."""
        data = np.frombuffer(self.data, np.uint8)
        if self.compression is not None:
            return codec.decoded(data, self.compression)
        return data.reshape(self.shape).copy() if data.size == math.prod(self.shape) else None

    def counts(self) -> NDArray[np.uint16] | None:
        """Return an image of depth, None where the data are damaged."""
        data = np.frombuffer(self.data, np.uint8)
        if self.compression is not None:
            return codec.decoded_depth(data)
        if data.size != 2 * math.prod(self.shape):
            return None
        return data.view("<u2").reshape(self.shape).astype(np.uint16)


def sequence_of(record: memoryview) -> int:
    """Return the sequence number of a message record."""
    sequence: int = _SEQUENCE.unpack_from(record, 11)[0]
    return sequence


def stored_image(record: memoryview, compressed: bool) -> StoredImage:
    """Take a message record apart."""
    fields = Fields(record[RECORD.itemsize :])
    fields.string()  # of the header: the frame
    if compressed:
        pixel_format, _, compression = fields.string().partition("; ")
        return StoredImage(pixel_format, compression, fields.data())
    height, width = fields.uint32(), fields.uint32()
    pixel_format = fields.string()
    fields.position += 1  # big-endian or not: single bytes are neither, and counts of depth are not
    channels = fields.uint32() // (2 * width if pixel_format == codec.DEPTH_FORMAT else width)
    shape = (height, width) if channels == 1 else (height, width, channels)
    return StoredImage(pixel_format, None, fields.data(), shape)


class Fields:
    """Reads the fields of a CDR message one behind the other, from behind the stamp of its header."""

    def __init__(self, body: memoryview) -> None:
        self._body = body
        self.position = len(ENCAPSULATION) + _STAMP_SIZE

    def uint32(self) -> int:
        """Return the next number."""
        self.position += -(self.position - len(ENCAPSULATION)) % 4
        value: int = _UINT32.unpack_from(self._body, self.position)[0]
        self.position += 4
        return value

    def string(self) -> str:
        """Return the next text."""
        length = self.uint32()
        text = bytes(self._body[self.position : self.position + length - 1]).decode()
        self.position += length
        return text

    def data(self) -> memoryview:
        """Return the next sequence of bytes."""
        length = self.uint32()
        return self._body[self.position : self.position + length]
