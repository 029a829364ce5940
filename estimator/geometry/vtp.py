"""Polygons of a VTK XML PolyData file: text, inline or appended binary, with or without zlib compression.

Layout: "VTK File Formats", section "XML file formats", and the VTK wiki, "VTK XML Formats".
"""

import base64
import zlib
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError

_ZLIB = "vtkZLibDataCompressor"
_MOST_BYTES = 400_000_000
_TYPES = ("Float32", "Float64", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)))


def read_vtp(content: bytes, file: Path) -> tuple[NDArray[np.float64], list[Sequence[int]]]:
    """Return vertices (n, 3), in the file's unit, and polygons as vertex numbers from 0; ``file`` is named.

    Raises
    ------
    InputError
        The file is no such file, damaged, or compressed by another method.
    """
    try:
        return _Document(content).polygons()
    except (
        *(ElementTree.ParseError, zlib.error),
        *(KeyError, ValueError, TypeError, IndexError, OverflowError),
    ) as error:
        raise InputError(
            f"{file}: cannot be read as VTP ({error}); save it again as PolyData, as text or compressed by zlib"
        ) from None


class _Document:
    """A parsed file; its binary appendix, which may be no valid XML, is kept apart."""

    def __init__(self, content: bytes) -> None:
        head, appended, tail = content.partition(b"<AppendedData")
        attributes, _, data = tail.partition(b"_")
        self._appendix = data
        self._appendix_is_text = b'"base64"' in attributes
        # entities can grow without end, and read files; without zero bytes UTF-16 looks like ASCII
        if b"<!DOCTYPE" in head.replace(b"\0", b""):
            raise ValueError("it declares a document type, which no VTP file does")
        root = ElementTree.fromstring(head + b"</VTKFile>" if appended else content)
        if root.attrib["type"] != "PolyData":
            raise ValueError(f"it holds {root.attrib['type']}")
        self._compressor = root.get("compressor")
        if self._compressor not in (None, _ZLIB):
            raise ValueError(f"compressed by {self._compressor}")
        self._order: Literal["<", ">"] = ">" if root.get("byte_order") == "BigEndian" else "<"
        self._header = np.dtype(root.get("header_type", "UInt32").lower()).newbyteorder(self._order)
        self._pieces = root.findall("./PolyData/Piece")

    def polygons(self) -> tuple[NDArray[np.float64], list[Sequence[int]]]:
        """Return the vertices and polygons of all pieces."""
        vertices, polygons, count = [np.zeros((0, 3))], list[Sequence[int]](), 0
        for piece in self._pieces:
            if int(piece.get("NumberOfStrips", "0")):
                raise ValueError("it holds triangle strips")
            points = self._values(piece.find("./Points/DataArray")).astype(np.float64).reshape(-1, 3)
            nodes = (
                self._values(piece.find("./Polys/DataArray[@Name='connectivity']")).astype(np.int64) + count
            )
            ends = self._values(piece.find("./Polys/DataArray[@Name='offsets']")).astype(np.int64)
            polygons += [part.tolist() for part in np.split(nodes, ends[:-1])] if len(ends) else []
            vertices.append(points)
            count += len(points)
        return np.concatenate(vertices), polygons

    def _values(self, array: ElementTree.Element | None) -> NDArray[np.generic]:
        if array is None:
            raise ValueError("points or polygons are missing")
        if array.attrib["type"] not in _TYPES:
            raise ValueError(f"it holds values of type {array.attrib['type'][:20]}")
        kind = np.dtype(array.attrib["type"].lower()).newbyteorder(self._order)
        form, text = array.attrib["format"], (array.text or "").strip()
        if form == "ascii":
            return np.array(text.split(), dtype=kind)
        if form == "binary":
            return np.frombuffer(self._decoded(_from_base64(text.encode()), 0), kind)
        take = _from_base64(self._appendix) if self._appendix_is_text else _from_raw(self._appendix)
        return np.frombuffer(self._decoded(take, int(array.attrib["offset"])), kind)

    def _decoded(self, take: "_Take", start: int) -> bytes:
        """Return the content of an array: a header of sizes, then the bytes or their compressed blocks."""
        word = self._header.itemsize
        if self._compressor is None:
            size = int(self._words(take(start, word)[0], 1)[0])
            return take(start, word + size)[0][word:]
        blocks, size, _ = (int(value) for value in self._words(take(start, 3 * word)[0], 3))
        if blocks * max(size, word) > _MOST_BYTES:
            raise ValueError("an array is too large")
        header, start = take(start, (3 + blocks) * word)
        sizes = [int(value) for value in self._words(header, 3 + blocks)[3:]]
        content, _ = take(start, sum(sizes))
        ends = np.cumsum([0, *sizes])
        return b"".join(_inflated(content[a:b], size) for a, b in pairwise(ends))

    def _words(self, header: bytes, count: int) -> NDArray[np.generic]:
        return np.frombuffer(header, self._header, count)


def _inflated(block: bytes, size: int) -> bytes:
    stream = zlib.decompressobj()
    content = stream.decompress(block, max(size, 1))
    if not stream.eof:
        raise ValueError("it is cut short")
    return content


# Returns so many bytes from a place on, and the place after them.
_Take = Callable[[int, int], tuple[bytes, int]]


def _from_raw(content: bytes) -> _Take:
    return lambda start, size: (content[start : start + size], start + size)


def _from_base64(content: bytes) -> _Take:
    def take(start: int, size: int) -> tuple[bytes, int]:
        end = start + 4 * -(-size // 3)
        return base64.b64decode(content[start:end], validate=True)[:size], end

    return take
