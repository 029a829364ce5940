"""Tells the format of a surface file by its content; how the file is called does not matter."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from estimator.errors import InputError
from estimator.input_file import read_input
from estimator.surfaces.formats.obj import read_obj
from estimator.surfaces.formats.ply import read_ply
from estimator.surfaces.formats.soup import PolygonSoup
from estimator.surfaces.formats.stl import counted_triangles, held_triangles, read_binary_stl, read_text_stl
from estimator.surfaces.formats.vtp import read_vtp

MOST_SURFACE_BYTES = 500_000_000
"""Largest file of a surface that is read: two million triangles as text."""

_Reader: TypeAlias = Callable[[bytes, Path], PolygonSoup]

# Of a text this much is looked at.
_BEGINNING = 20_000
_FORMATS = "STL, PLY, OBJ or VTP"
# Files of other kinds that stand where a surface should, by how they begin, and what to do with them.
_OTHERS: tuple[tuple[bytes, str], ...] = (
    (b"PK\x03\x04", "a ZIP archive, such as 3MF files are; unpack it, or export the surface as STL"),
    (b"\x1f\x8b", "compressed by gzip; unpack it"),
    (b"ISO-10303-21", f"a STEP file, which holds no triangles; export the surface as {_FORMATS}"),
    (b"# vtk DataFile", "a legacy VTK file; save it as VTP (XML PolyData)"),
    (b"OFF", f"an OFF file; save it as {_FORMATS}"),
    (b"glTF", f"a glTF file; save it as {_FORMATS}"),
    (b"NRRD", "an image volume (NRRD), not a surface; export the segment as STL"),
    (b"%PDF", f"a PDF file, not a surface; name a file in {_FORMATS}"),
    (b"\x89PNG", f"a picture, not a surface; name a file in {_FORMATS}"),
)
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_FACET = re.compile(rb"\A\s*solid\b|^\s*facet\b", re.IGNORECASE | re.MULTILINE)
_OBJ_LINE = re.compile(rb"^\s*(v|f|vn|vt|o|g|mtllib|usemtl)\s+\S", re.MULTILINE)


def read_soup(file: Path) -> PolygonSoup:
    """Read the polygons of a surface file, in the file's unit.

    Raises
    ------
    InputError
        The file is missing, too large, of another kind or damaged; the message names what was found.
    """
    content = read_input(file, MOST_SURFACE_BYTES)
    if not content.strip(b"\0 \t\r\n"):
        raise InputError(f"{file}: is empty; export the surface again, or copy it again")
    content = _as_utf8(content)
    return _reader(content, file)(content, file)


def _reader(content: bytes, file: Path) -> _Reader:
    beginning = content[:_BEGINNING].lstrip()
    for start, kind in _OTHERS:
        if beginning.startswith(start):
            raise InputError(f"{file}: is {kind}")
    if re.match(rb"ply\s", beginning):
        return read_ply
    if beginning.startswith(b"<"):
        if b"<VTKFile" not in beginning and b"<!DOCTYPE VTKFile" not in beginning:
            raise InputError(f"{file}: is XML or HTML, but no VTK file; name a surface in {_FORMATS}")
        return read_vtp
    counted, (held, left) = counted_triangles(content), held_triangles(content)
    if counted is not None and held and 0 < counted <= held:
        return read_binary_stl
    if b"\0" not in beginning:
        lines = _with_line_feeds(beginning)
        if _FACET.search(lines):
            return read_text_stl
        if _OBJ_LINE.search(lines):
            return lambda content, file: read_obj(_with_line_feeds(content), file)
    elif file.suffix.lower() == ".stl" or (counted is not None and held and not left):
        return read_binary_stl
    raise InputError(
        f"{file}: is neither {_FORMATS}: it begins with {content[:20]!r}; export the surface in one of these"
    )


def _as_utf8(content: bytes) -> bytes:
    """Return a text that is marked as UTF-16 or UTF-8 in UTF-8, without the mark; anything else as it is."""
    if content.startswith(_UTF16_MARKS):
        text = content.decode("utf-16", "replace")
        return re.sub(r"^\s*<\?xml[^>]*\?>", "", text).encode()
    return content.removeprefix(b"\xef\xbb\xbf")


def _with_line_feeds(content: bytes) -> bytes:
    return content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
