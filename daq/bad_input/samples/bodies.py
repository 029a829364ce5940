"""Segmentations, volume meshes and stated phantoms as other programs write them."""

import gzip
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.geometry.shapes import sphere_surface
from estimator.meshes.volume_mesh import VolumeMesh
from estimator.meshes.writing import write_mesh
from estimator.surfaces.writing import write_ply

_SPACING_MM = 4.0


def nifti(folder: Path) -> None:
    """Write a NIfTI file."""
    (folder / "body.nii").write_bytes(_nifti())


def nifti_packed(folder: Path) -> None:
    """Write a NIfTI file packed by gzip."""
    (folder / "body.nii.gz").write_bytes(gzip.compress(_nifti(), mtime=0))


def nrrd_file(folder: Path) -> None:
    """Write an NRRD file."""
    header = {
        "space": "left-posterior-superior",
        "space directions": _SPACING_MM * np.eye(3),
        "space origin": np.zeros(3),
        "encoding": "raw",
    }
    import nrrd

    nrrd.write(str(folder / "body.nrrd"), _ball(), header, index_order="F")


def metaimage(folder: Path) -> None:
    """Write a header of MetaImage with its data beside it."""
    labels = _ball()
    lines = [
        *("ObjectType = Image", "NDims = 3", "BinaryData = True", "BinaryDataByteOrderMSB = False"),
        *("TransformMatrix = 1 0 0 0 1 0 0 0 1", "Offset = 0 0 0", f"ElementSpacing = {' '.join(['4'] * 3)}"),
        f"DimSize = {' '.join(map(str, labels.shape))}",
        *("ElementType = MET_UCHAR", "ElementDataFile = body.raw"),
    ]
    (folder / "body.mhd").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "body.raw").write_bytes(labels.tobytes(order="F"))


def msh(folder: Path) -> None:
    """Write an MSH 4.1 file."""
    write_mesh(_cube(), folder / "body.msh")


def inp(folder: Path) -> None:
    """Write an Abaqus input file."""
    write_mesh(_cube(), folder / "body.inp")


def vtu(folder: Path) -> None:
    """Write a VTU file."""
    write_mesh(_cube(), folder / "body.vtu")


def med(folder: Path) -> None:
    """Write a MED file."""
    import meshio

    mesh = _cube()
    meshio.Mesh(mesh.points, [("tetra", mesh.blocks["tet4"])]).write(folder / "body.med")


def stated_phantom(folder: Path) -> None:
    """Write a phantom with a region and a painted grasp."""
    body = sphere_surface(0.05, 2)
    write_ply(body, folder / "body.ply")
    write_ply(sphere_surface(0.01, 1), folder / "lump.ply")
    rows = [f"{x!r} {y!r} {z!r} {int(x > 0.03)}" for x, y, z in body.vertices.tolist()]
    header = f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz") + "property int held\nend_header\n"
    (folder / "painted.ply").write_text(header + "\n".join(rows) + "\n", encoding="utf-8")
    (folder / "phantom.toml").write_text(_PHANTOM, encoding="utf-8")


_PHANTOM = """format = "retraction-phantom/1"

[phantom]
shape = "surface"
surface = "body.ply"
unit = "m"
density = 1070.0

[[phantom.region]]
name = "lump"
surface = "lump.ply"
modulus_ratio = 2.0

[[anchor]]
box = [[-0.06, -0.06, -0.06], [-0.03, 0.06, 0.06]]

[grasp]
painted = "painted.ply"
scalar = "held"
value = 1.0

[fiducials]
rest = [[0.0, 0.0, 0.05]]
"""


def _ball() -> NDArray[np.uint8]:
    index = np.moveaxis(np.indices((12, 11, 10)), 0, -1)
    return (np.linalg.norm(index - (6, 5, 5), axis=-1) < 4).astype(np.uint8)


def _nifti() -> bytes:
    import nibabel  # 30 MB, of one kind of files among many

    image = nibabel.Nifti1Image(_ball(), np.diag([-_SPACING_MM, -_SPACING_MM, _SPACING_MM, 1.0]))
    image.header.set_xyzt_units("mm")
    return bytes(image.to_bytes())


def _cube() -> VolumeMesh:
    """A cube of five tetrahedra."""
    points = 0.1 * np.array([[i, j, k] for i in (0.0, 1) for j in (0, 1) for k in (0, 1)])
    cells = np.array([[0, 4, 2, 1], [6, 2, 4, 7], [5, 1, 7, 4], [3, 7, 1, 2], [1, 2, 7, 4]])
    held = np.arange(8) < 4
    return VolumeMesh(points, {"tet4": cells}, {"lump": {"tet4": np.arange(5) == 4}}, {"wall": held})
