"""Writes a volume mesh in the format that the name of the file asks for."""

from collections.abc import Callable, Mapping
from pathlib import Path

from estimator.errors import InputError
from estimator.fem.discretisation.mesh import Mesh
from estimator.meshes.formats.feb import write_feb
from estimator.meshes.formats.inp_writing import write_inp
from estimator.meshes.formats.msh import write_msh
from estimator.meshes.formats.vtu import write_vtu
from estimator.meshes.volume_mesh import BoolArray, VolumeMesh

_WRITERS: Mapping[str, Callable[[VolumeMesh, Path], None]] = {
    ".vtu": write_vtu,
    ".msh": write_msh,
    ".inp": write_inp,
    ".feb": write_feb,
}


def check_mesh_name(file: Path) -> None:
    """Refuse a file that is not named as one of the formats.

    Raises
    ------
    InputError
        It is not.
    """
    if file.suffix.lower() not in _WRITERS:
        raise InputError(
            f"{file}: meshes are written as {', '.join(_WRITERS)}; give a name that ends with one of these"
        )


def write_mesh(mesh: VolumeMesh, file: Path) -> None:
    """Write a mesh as VTU, MSH 4.1, INP or FEB, in metres, over any file that is there.

    Raises
    ------
    InputError
        The file is not named as one of these.
    """
    check_mesh_name(file)
    _WRITERS[file.suffix.lower()](mesh, file)


def volume_mesh_of(mesh: Mesh, node_sets: Mapping[str, BoolArray]) -> VolumeMesh:
    """Return a mesh of tetrahedra with sets of its nodes as one to write.

    Raises
    ------
    InputError
        It is of hexahedra with nodes on edges.
    """
    if mesh.kind == "tet4" or mesh.kind == "tet10":
        return VolumeMesh(mesh.points, {mesh.kind: mesh.cells}, node_sets=node_sets)
    raise InputError(f"a mesh of {mesh.kind} cannot be written; give one of tet4 or tet10")
