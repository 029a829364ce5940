"""Reads the surface of a phantom from a file in STL, PLY, OBJ or VTP: the one way in for every verb.

Every process of a laboratory reads experiments, and few of those have a surface: what repairs these, and the compiler
of its loops with it, is imported where it is needed.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.input_file import require_file
from estimator.surfaces.formats.recognition import read_soup
from estimator.surfaces.units import Unit

if TYPE_CHECKING:
    from estimator.surfaces.repair import RepairedSurface

FloatArray = NDArray[np.float64]

# A diagnosis meshes the surface of each of its experiments several times; reading a large one takes seconds.
_FILES = 8


def read_surface(file: Path | str, unit: Unit | None = None) -> RepairedSurface:
    """Read a closed surface, m, and tell what was repaired.

    The format is told from the content. As long as the file stays as it is, it is read once.

    Parameters
    ----------
    file : STL, PLY, OBJ or VTP
    unit : of its lengths; None for metres, or millimetres where only these give a phantom

    Raises
    ------
    InputError
        The file is missing, too large, of another kind or damaged, its unit cannot be told, or it holds no closed
        surface of one body and none that it could be repaired to; the message names the file.
    """
    path = Path(file)
    require_file(path)
    found = path.stat()
    return _read_surface(path, unit, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=_FILES)
def _read_surface(path: Path, unit: Unit | None, _modified_ns: int, _size: int) -> RepairedSurface:
    from estimator.surfaces.repair import repaired

    return repaired(read_soup(path), str(path), unit)


def surface_bounds(file: Path | str, unit: Unit | None = None) -> FloatArray:
    """Return the lower and upper corner of the bounding box of a surface, (2, 3), m, whether it is closed or not.

    Raises
    ------
    InputError
        The file cannot be read, or the unit cannot be told.
    """
    try:
        return read_surface(file, unit).surface.bounds
    except InputError:
        from estimator.surfaces.repair import in_metres

        soup = read_soup(Path(file))
        vertices, _ = in_metres(soup, str(file), unit)
        used = vertices[soup.nodes]
        return np.array([used.min(axis=0), used.max(axis=0)])
