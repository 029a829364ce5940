"""Triangles of an STL file, binary or text ("StL Interface Specification", 3D Systems, 1989).

Binary: 80 bytes of header, the number of triangles, and 50 bytes for each of them. The header may say anything, even
"solid", with which the text begins.
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.surfaces.formats.soup import PolygonSoup, soup_of_corners

FloatArray = NDArray[np.float64]

_HEADER_BYTES = 84
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
# What programs leave in the place of a count that they do not know when they begin to write.
_PLACEHOLDERS = (0, 2**32 - 1)
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)")
_NEAR = 10.0  # sizes of the triangles that are counted, within which others may be more of them
_CHUNK_BYTES = 20_000_000


def counted_triangles(content: bytes) -> int | None:
    """Return how many triangles the header of a binary file tells; None where the file is shorter than a header."""
    return int.from_bytes(content[80:_HEADER_BYTES], "little") if len(content) >= _HEADER_BYTES else None


def held_triangles(content: bytes) -> tuple[int, int]:
    """Return for how many triangles there is room behind the header of a binary file, and the bytes that are left."""
    return divmod(max(len(content) - _HEADER_BYTES, 0), _TRIANGLE.itemsize)


def read_binary_stl(content: bytes, file: Path) -> PolygonSoup:
    """Return the triangles of a binary file, in its unit; ``file`` is named.

    Raises
    ------
    InputError
        The file is cut short within a triangle, or a corner is not finite.
    """
    counted, (held, left) = counted_triangles(content), held_triangles(content)
    if counted is None:
        raise InputError(
            f"{file}: {len(content)} bytes, where the header of a binary STL file alone takes 84: it is cut short; "
            "export the surface again"
        )
    remarks: tuple[str, ...] = ()
    if held and not left and (counted in _PLACEHOLDERS or counted > held or _go_on(content, counted, held)):
        remarks = (
            (f"the header counts {counted} triangles; the {held} for which the file has room were read",)
            if counted != held
            else ()
        )
        counted = held
    elif counted > held:
        raise InputError(
            f"{file}: its header counts {counted} triangles and there is room for {held} in the file: it is cut "
            "short; export the surface again, or copy it again"
        )
    elif counted == 0:
        raise InputError(f"{file}: its header counts 0 triangles; export the surface again")
    elif extra := len(content) - _HEADER_BYTES - counted * _TRIANGLE.itemsize:
        remarks = (f"{extra} bytes behind the last triangle were left out",)
    corners = _binary_corners(content, counted)
    if not np.isfinite(corners).all():
        bad = int(np.argmin(np.isfinite(corners).all(axis=(1, 2))))
        raise InputError(
            f"{file}: triangle {bad} (from 0) has a corner that is no finite number: the file is damaged, or no "
            "binary STL; export the surface again"
        )
    return soup_of_corners(corners, remarks)


def read_text_stl(content: bytes, file: Path) -> PolygonSoup:
    """Return the facets of a text file, in its unit; ``file`` is named. Capitals and line ends of any kind will do.

    Raises
    ------
    InputError
        There is no facet, the last one is cut short, or a coordinate is no number.
    """
    text = content.lower()
    corners = np.concatenate([np.empty((0, 3)), *(_corners(chunk, file) for chunk in _chunks(text))])
    if not np.isfinite(corners).all():
        bad = int(np.argmin(np.isfinite(corners).all(axis=1)))
        raise InputError(f"{file}: vertex {bad} (from 0) is not finite; export the surface again")
    if not len(corners):
        raise InputError(
            f"{file}: a text STL without a facet; export the surface again, with the body selected"
        )
    if len(corners) == 3 * text.count(b"endloop"):
        return soup_of_corners(corners.reshape(-1, 3, 3))
    *loops, rest = (len(_VERTEX.findall(loop)) for loop in text.split(b"endloop"))
    if rest or not loops:
        raise InputError(
            f"{file}: a text STL that ends within facet {len(loops)} (from 0): it is cut short; export the surface "
            "again, or copy it again"
        )
    return PolygonSoup(
        corners, np.arange(len(corners)), np.cumsum(loops, dtype=np.int64), shares_vertices=False
    )


def _go_on(content: bytes, counted: int, held: int) -> bool:
    """Tell whether what stands behind the triangles that are counted is more of them: none lies far outside."""
    if not 0 < counted < held:
        return False
    corners = _binary_corners(content, held)
    if not np.isfinite(corners).all():
        return False
    mine = corners[:counted].reshape(-1, 3)
    lower, upper = mine.min(axis=0), mine.max(axis=0)
    room, more = _NEAR * (upper - lower).max(), corners[counted:].reshape(-1, 3)
    return bool(np.all((more >= lower - room) & (more <= upper + room)) and np.any(more))


def _binary_corners(content: bytes, count: int) -> FloatArray:
    rows = np.frombuffer(content, _TRIANGLE, count=count, offset=_HEADER_BYTES)
    with np.errstate(invalid="ignore"):  # bits that are no number are refused by the caller
        return rows["corners"].astype(np.float64)


def _chunks(text: bytes) -> list[bytes]:
    """Cut a text in front of a vertex, so that what its numbers take as objects stays small."""
    cuts = [0]
    while len(text) - cuts[-1] > _CHUNK_BYTES:
        cut = text.rfind(b"vertex", cuts[-1] + 1, cuts[-1] + _CHUNK_BYTES)
        if cut < 0:
            break
        cuts.append(cut)
    return [text[begin:end] for begin, end in zip(cuts, [*cuts[1:], len(text)], strict=True)]


def _corners(chunk: bytes, file: Path) -> FloatArray:
    found = _VERTEX.findall(chunk)
    try:
        return np.array(found, dtype=np.float64).reshape(-1, 3)
    except ValueError:
        bad = next(word for corner in found for word in corner if not _is_number(word))
    raise InputError(
        f"{file}: a vertex has the coordinate {bad[:40].decode('utf-8', 'replace')!r}, which is no number; write "
        "numbers with a decimal point"
    )


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
