"""Reads a volume mesh in MSH, VTU, Abaqus INP or MED, told by its content, with every element checked."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.input_file import require_file
from estimator.meshes.elements import in_order, point_volumes
from estimator.meshes.formats.by_meshio import read_by_meshio
from estimator.meshes.formats.inp import read_inp
from estimator.meshes.formats.msh41 import read_msh41
from estimator.meshes.volume_mesh import FoundMesh, VolumeMesh
from estimator.surfaces.units import METRES, Unit, unit_of

FloatArray = NDArray[np.float64]

_MOST_BYTES = 2_000_000_000
_BEGINNING = 4000
_HDF5 = b"\x89HDF\r\n\x1a\n"
_INP = re.compile(rb"^\*(HEADING|NODE|PART|INCLUDE|ASSEMBLY|PREPRINT)\b", re.IGNORECASE | re.MULTILINE)


_READERS: Mapping[str, Callable[[Path], FoundMesh]] = {
    "MSH 2": lambda file: read_by_meshio(file, "MSH"),
    "MSH 4": read_msh41,
    "VTU": lambda file: read_by_meshio(file, "VTU"),
    "MED": lambda file: read_by_meshio(file, "MED"),
    "INP": read_inp,
}


@dataclass(frozen=True, eq=False)
class ReadMesh:
    """A mesh that was read.

    Attributes
    ----------
    mesh : VolumeMesh
    repairs : what was done to the elements that the file holds, in words
    left_out : what it holds besides, in words
    """

    mesh: VolumeMesh
    repairs: tuple[str, ...]
    left_out: tuple[str, ...]


def is_volume_mesh(file: Path) -> bool:
    """Tell by its first bytes whether a file is one of those that :func:`read_volume_mesh` reads.

    Raises
    ------
    InputError
        There is no such file.
    """
    require_file(file)
    return _form(file) is not None


def read_volume_mesh(file: Path | str, unit: Unit | None = None) -> ReadMesh:
    """Read a mesh of tetrahedra, pyramids, wedges and hexahedra, m.

    Every element is there once, with positive volume and its nodes in order; second-order tetrahedra stay so.

    Parameters
    ----------
    file : MSH 2.2 or 4.1, VTU, INP (Abaqus, CalculiX) or MED
    unit : of its lengths; None for metres, or millimetres where only these give a phantom

    Raises
    ------
    InputError
        The file is missing, too large, of another kind or damaged, holds no volume elements, or some that are folded
        or fill the same space; the message names the file.
    """
    path = Path(file)
    if require_file(path) > _MOST_BYTES:
        raise InputError(f"{path}: is larger than {_MOST_BYTES / 1e9:.0f} GB; coarsen the mesh")
    form = _form(path)
    if form is None:
        raise InputError(f"{path}: is no mesh in MSH, VTU, INP or MED; save it in one of these")
    found = _READERS[form](path)
    found, repairs = in_order(found, str(path))
    used = np.unique(np.concatenate([cells.ravel() for cells in found.blocks.values()]))
    number = np.full(len(found.points), -1)
    number[used] = np.arange(len(used))
    points = found.points[used]
    which, told = unit_of(float(np.ptp(points, axis=0).max()), unit, str(path))
    sets = {name: nodes[used] for name, nodes in found.node_sets.items() if nodes[used].any()}
    mesh = VolumeMesh(
        points * METRES[which],
        {kind: number[cells] for kind, cells in found.blocks.items() if len(cells)},
        found.regions,
        sets,
    )
    return ReadMesh(mesh, (*repairs, *([told] if told else [])), found.remarks)


def volume_m3(mesh: VolumeMesh) -> float:
    """Return the volume of a mesh."""
    return float(sum(point_volumes(mesh.points, kind, cells).sum() for kind, cells in mesh.blocks.items()))


def _form(file: Path) -> str | None:
    with file.open("rb") as stream:
        beginning = stream.read(_BEGINNING)
    if beginning.lstrip().startswith((b"$MeshFormat", b"$Comments", b"$NOD")):
        version = re.search(rb"\$MeshFormat\s+(\d)", beginning)
        return "MSH 4" if version and version[1] == b"4" else "MSH 2"
    if beginning.startswith(_HDF5):
        return "MED"
    if b"<VTKFile" in beginning and re.search(rb"""type\s*=\s*["']UnstructuredGrid""", beginning):
        return "VTU"
    return "INP" if _INP.search(beginning.replace(b"\r", b"\n")) else None
