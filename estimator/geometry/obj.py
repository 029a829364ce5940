"""Polygons of a Wavefront OBJ file; only its lines ``v`` and ``f`` are read."""

from collections.abc import Sequence
from pathlib import Path

from estimator.errors import InputError


def read_obj(content: bytes, file: Path) -> tuple[list[Sequence[float]], list[Sequence[int]]]:
    """Return vertices (x, y, z), in the file's unit, and polygons as vertex numbers from 0; ``file`` is named.

    Raises
    ------
    InputError
        A line cannot be read; the message names it.
    """
    vertices: list[Sequence[float]] = []
    polygons: list[Sequence[int]] = []
    for number, line in enumerate(content.decode("utf-8", "replace").splitlines(), start=1):
        kind, *words = line.split() or [""]
        try:
            if kind == "v":
                x, y, z = map(float, words[:3])
                vertices.append((x, y, z))
            elif kind == "f":
                polygons.append([_index(word, len(vertices)) for word in words])
        except ValueError:
            raise InputError(
                f"{file}, line {number}: not understood: {line[:60]!r}; export the surface again"
            ) from None
    return vertices, polygons


def _index(word: str, known: int) -> int:
    """Return the vertex number from 0 of ``vertex/texture/normal``; a negative one counts back from the last."""
    index = int(word.partition("/")[0])
    if index == 0:
        raise ValueError
    return index - 1 if index > 0 else known + index
