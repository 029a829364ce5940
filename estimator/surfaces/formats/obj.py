"""Polygons of a Wavefront OBJ file; only its lines ``v`` and ``f`` are read."""

from pathlib import Path

import numpy as np

from estimator.errors import InputError
from estimator.surfaces.formats.soup import PolygonSoup

_FACES = ("f", "fo")  # the latter is the older of the two


def read_obj(content: bytes, file: Path) -> PolygonSoup:
    """Return the polygons of the file, in its unit; ``file`` is named.

    Raises
    ------
    InputError
        A line cannot be read; the message names it.
    """
    vertices: list[tuple[float, float, float]] = []
    nodes: list[int] = []
    ends: list[int] = []
    text = content.decode("utf-8", "replace").replace("\\\r\n", "  ").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), start=1):
        kind, *words = line.partition("#")[0].split() or [""]
        try:
            if kind == "v":
                x, y, z = map(float, words[:3])
                vertices.append((x, y, z))
            elif kind in _FACES:
                if len(words) < 3:
                    raise ValueError
                nodes += [_index(word, len(vertices)) for word in words]
                ends.append(len(nodes))
        except ValueError:
            raise InputError(
                f"{file}, line {number}: not understood: {line[:60]!r}; a vertex takes three numbers with decimal "
                "points, a face at least three vertex numbers from 1: export the surface again"
            ) from None
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    try:
        return PolygonSoup(points, np.array(nodes, dtype=np.int64), np.array(ends, dtype=np.int64))
    except OverflowError:
        raise InputError(
            f"{file}: a face names a vertex beyond all numbers; export the surface again"
        ) from None


def _index(word: str, known: int) -> int:
    """Return the vertex number from 0 of ``vertex/texture/normal``; a negative one counts back from the last."""
    index = int(word.partition("/")[0])
    if index == 0:
        raise ValueError
    return index - 1 if index > 0 else known + index
