"""Whether bytes are a whole PNG file, before a library decodes them that writes its complaints where it likes.

W3C, "Portable Network Graphics (PNG) Specification", section 5: signature, then chunks of length, type, data and CRC.
"""

import struct
import zlib

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER = struct.Struct(">II")
_LENGTH = struct.Struct(">I")
_MOST_PIXELS = 100_000_000


def is_whole_png(content: bytes | memoryview) -> bool:
    """Tell whether every chunk to the last is there and bears its checksum, and the size is that of a photograph."""
    data = memoryview(content).cast("B")
    if bytes(data[: len(_SIGNATURE)]) != _SIGNATURE or bytes(data[12:16]) != b"IHDR" or len(data) < 33:
        return False
    width, height = _HEADER.unpack_from(data, 16)
    if not 0 < width * height <= _MOST_PIXELS:
        return False
    place = len(_SIGNATURE)
    while place + 12 <= len(data):
        (length,) = _LENGTH.unpack_from(data, place)
        end = place + 8 + length
        if end + 4 > len(data) or zlib.crc32(data[place + 4 : end]) != _LENGTH.unpack_from(data, end)[0]:
            return False
        if bytes(data[place + 4 : place + 8]) == b"IEND":
            return True
        place = end + 4
    return False
