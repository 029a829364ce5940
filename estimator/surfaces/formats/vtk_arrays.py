"""Data arrays of VTK XML files: text, base64 within the element, or appended, raw or in base64, compressed or not.

Layout: "VTK File Formats", section "XML file formats"; the compressors are those of ``vtkXMLWriterBase``.
"""

import base64
import lzma
import zlib
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Literal
from xml.etree import ElementTree

import lz4.block
import numpy as np
from numpy.typing import NDArray

_MOST_BYTES = 400_000_000
_TYPES = ("Float32", "Float64", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)))

DAMAGED = (
    *(ElementTree.ParseError, zlib.error, lzma.LZMAError, lz4.block.LZ4BlockError),
    *(KeyError, ValueError, TypeError, IndexError, OverflowError),
)
"""What reading a damaged file raises."""


class VtkXml:
    """A parsed file; its binary appendix, which may be no valid XML, is kept apart.

    Raises
    ------
    ValueError
        The file is compressed by an unknown method, or declares a document type; or anything of :data:`DAMAGED`.
    """

    def __init__(self, content: bytes) -> None:
        head, appended, tail = content.partition(b"<AppendedData")
        attributes, _, data = tail.partition(b"_")
        self._appendix = data
        self._appendix_is_text = b"base64" in attributes
        # entities can grow without end, and read files; without zero bytes UTF-16 looks like ASCII
        if b"<!DOCTYPE" in head.replace(b"\0", b""):
            raise ValueError("it declares a document type, which no VTP file does")
        self.root = ElementTree.fromstring(head + b"</VTKFile>" if appended else content)
        self._inflate: _Inflate | None = None
        if (compressor := self.root.get("compressor")) is not None:
            if compressor not in _COMPRESSORS:
                raise ValueError(f"compressed by {compressor[:40]}; zlib, LZ4 and LZMA can be read")
            self._inflate = _COMPRESSORS[compressor]
        self._order: Literal["<", ">"] = ">" if self.root.get("byte_order") == "BigEndian" else "<"
        header = self.root.get("header_type", "UInt32")
        if header not in ("UInt32", "UInt64"):
            raise ValueError(f"its sizes are of type {header[:20]}")
        self._header = np.dtype(header.lower()).newbyteorder(self._order)

    def values(self, array: ElementTree.Element | None) -> NDArray[np.generic]:
        """Return the values of a data array, in one row."""
        if array is None:
            raise ValueError("an array of its points or cells is missing")
        if array.attrib["type"] not in _TYPES:
            raise ValueError(f"it holds values of type {array.attrib['type'][:20]}")
        kind = np.dtype(array.attrib["type"].lower()).newbyteorder(self._order)
        form, text = array.attrib["format"], (array.text or "").strip()
        if form == "ascii":
            return np.array(text.split(), dtype=kind)
        if form == "binary":
            return np.frombuffer(self._decoded(_from_base64(text.encode()), 0), kind)
        if form != "appended":
            raise ValueError(f"an array is in the format {form[:20]}")
        take = _from_base64(self._appendix) if self._appendix_is_text else _from_raw(self._appendix)
        return np.frombuffer(self._decoded(take, int(array.attrib["offset"])), kind)

    def _decoded(self, take: "_Take", start: int) -> bytes:
        """Return the content of an array: a header of sizes, then the bytes or their compressed blocks."""
        word = self._header.itemsize
        if self._inflate is None:
            size = int(self._words(take(start, word)[0], 1)[0])
            return take(start, word + size)[0][word:]
        blocks, size, last = (int(value) for value in self._words(take(start, 3 * word)[0], 3))
        if blocks * max(size, word) > _MOST_BYTES:
            raise ValueError("an array is too large")
        header, start = take(start, (3 + blocks) * word)
        packed = [int(value) for value in self._words(header, 3 + blocks)[3:]]
        content, _ = take(start, sum(packed))
        ends = np.cumsum([0, *packed])
        full = [size] * max(blocks - 1, 0) + [last or size] * min(blocks, 1)
        return b"".join(
            self._inflate(content[a:b], length) for (a, b), length in zip(pairwise(ends), full, strict=True)
        )

    def _words(self, header: bytes, count: int) -> NDArray[np.generic]:
        return np.frombuffer(header, self._header, count)


# Returns what a block holds, of so many bytes.
_Inflate = Callable[[bytes, int], bytes]
# Returns so many bytes from a place on, and the place after them.
_Take = Callable[[int, int], tuple[bytes, int]]


def _by_zlib(block: bytes, size: int) -> bytes:
    stream = zlib.decompressobj()
    return _whole(stream.decompress(block, max(size, 1)), size)


def _by_lzma(block: bytes, size: int) -> bytes:
    stream = lzma.LZMADecompressor(memlimit=_MOST_BYTES)
    return _whole(stream.decompress(block, max(size, 1)), size)


def _by_lz4(block: bytes, size: int) -> bytes:
    return _whole(lz4.block.decompress(block, uncompressed_size=size), size)


def _whole(content: bytes, size: int) -> bytes:
    if len(content) != size:
        raise ValueError("it is cut short")
    return content


_COMPRESSORS: Mapping[str, _Inflate] = {
    "vtkZLibDataCompressor": _by_zlib,
    "vtkLZ4DataCompressor": _by_lz4,
    "vtkLZMADataCompressor": _by_lzma,
}


def _from_raw(content: bytes) -> _Take:
    return lambda start, size: (content[start : start + size], start + size)


def _from_base64(content: bytes) -> _Take:
    def take(start: int, size: int) -> tuple[bytes, int]:
        end = start + 4 * -(-size // 3)
        return base64.b64decode(content[start:end], validate=True)[:size], end

    return take
