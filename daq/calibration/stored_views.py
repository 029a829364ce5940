"""Views of the board that lie in a folder, a left and a right image of each moment."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.calibration.view_names import TOLERANCE_S, PairedNames, pair_names
from daq.errors import CalibrationError
from daq.files.png import is_whole_png
from estimator.input_file import read_input

_MOST_IMAGE_BYTES = 100_000_000
_MOST_NAMED = 20


@dataclass(frozen=True, slots=True)
class View:
    """Grey images (height, width) of one moment; ``name`` is that of both files."""

    name: str
    left: NDArray[np.uint8]
    right: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class StoredViews:
    """Pairs of image files below a folder; see :func:`find_views`."""

    folder: Path
    names: PairedNames

    def describe(self) -> str:
        """Say, in a line or two, how many pairs there are, how they were found, and what has no partner."""
        lines = [f"{self.folder}: {len(self.names.pairs)} pairs; {self.names.told_by}"]
        if alone := self.names.alone:
            more = f" and {len(alone) - _MOST_NAMED} more" if len(alone) > _MOST_NAMED else ""
            lines.append(f"without a partner, left out: {', '.join(alone[:_MOST_NAMED])}{more}")
        return "\n".join(lines)

    def read(self) -> Iterator[View]:
        """Read the pairs one after the other; raises CalibrationError where a file cannot be decoded."""
        for left, right in self.names.pairs:
            yield View(f"{left} with {right}", _image(self.folder / left), _image(self.folder / right))


def single_views(folder: Path) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    """Read the PNG images in a folder and the folders below it, by name and in the order of their names.

    Raises
    ------
    CalibrationError
        There is no image, or one cannot be decoded.
    """
    for name in _png_names(folder):
        yield name, _image(folder / name)


def find_views(
    folder: Path, marks: tuple[str, str] | None = None, tolerance_s: float = TOLERANCE_S
) -> StoredViews:
    """Pair the PNG images in a folder and the folders below it, by :func:`daq.calibration.view_names.pair_names`.

    Raises
    ------
    CalibrationError
        There is no image, the names do not tell which belong together, or one of a pair is no whole PNG image.
    """
    names = _png_names(folder)
    try:
        found = pair_names(names, marks, tolerance_s)
    except CalibrationError as error:
        raise CalibrationError(f"{folder}: {error}") from error
    for name in (name for pair in found.pairs for name in pair):
        _whole(folder / name)  # now, and not after minutes with those before it
    return StoredViews(folder, found)


def _png_names(folder: Path) -> list[str]:
    names = sorted(
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.suffix.lower() == ".png" and path.is_file()
    )
    if not names:
        raise CalibrationError(f"{folder}: holds no PNG image; give the folder of the views of the board")
    return names


def _image(path: Path) -> NDArray[np.uint8]:
    found = cv2.imdecode(np.frombuffer(_whole(path), np.uint8), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH)
    if found is None:
        raise CalibrationError(f"{path}: cannot be decoded; take the view again, or remove the file")
    return _in_bytes(np.asarray(found))


def _in_bytes(image: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Return an image of 16 bits in 8: of a camera's 10, 12 or 14 bits the lower ones of the file may be used alone."""
    if image.dtype == np.uint8:
        return np.asarray(image, dtype=np.uint8)
    grey = np.asarray(image, dtype=np.float64)
    return np.asarray(np.round(grey * (255.0 / max(float(grey.max()), 1.0))), dtype=np.uint8)


def _whole(path: Path) -> bytes:
    content = read_input(path, _MOST_IMAGE_BYTES)
    if not is_whole_png(content):
        raise CalibrationError(f"{path}: is no whole PNG image; take the view again, or remove the file")
    return content
