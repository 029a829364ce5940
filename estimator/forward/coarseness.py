"""Whether a mesh of tetrahedra is coarse where the tissue is thin."""

import numpy as np
from numpy.typing import NDArray

from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.surface import boundary_faces

FloatArray = NDArray[np.float64]

# A single tetrahedron across the tissue that is longer than this many times the tissue's thickness there is too stiff
# in bending.
_SLENDER = 2.5
# Of the surface that such elements lie under: less is a rim.
_SHARE = 0.02
# Cosine of the angle between the outward normals of two sides of a sheet.
_OPPOSITE = -0.7


def thin_tissue_note(mesh: Mesh) -> str:
    """Return a sentence where single elements span thin tissue and are far longer than it is thin; else nothing.

    Hexahedra are made to be long in thin sheets, and are not looked at.
    """
    if not mesh.kind.startswith("tet"):
        return ""
    faces = boundary_faces(mesh)[:, :3]
    area, normal = _areas(mesh.points[faces])
    element = _elements_of(mesh.cells[:, :4], faces)
    corners = mesh.cells[element, :4]
    opposite = corners[~(corners[:, :, None] == faces[:, None, :]).any(axis=2)]
    thin = _faces_away(opposite, normal, faces, len(mesh.points))
    points = mesh.points[corners]
    height = np.einsum("fx,fx->f", normal, mesh.points[faces[:, 0]] - mesh.points[opposite])
    longest = np.linalg.norm(points[:, :, None] - points[:, None, :], axis=-1).max(axis=(1, 2))
    slender = thin & (longest > _SLENDER * height)
    share = float(area[slender].sum() / area.sum())
    if share < _SHARE:
        return ""
    worst = int(np.argmax(np.where(slender, longest / height, 0.0)))
    return (
        f"the mesh is coarse where the tissue is thin: below {100 * share:.0f} % of the surface a single element spans "
        f"it, up to {1e3 * longest[worst]:.1f} mm long where it is {1e3 * height[worst]:.1f} mm thick; look at what a "
        "finer mesh changes, or close or thicken what is that thin"
    )


def _areas(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return areas (f,) and outward unit normals (f, 3) of triangles (f, 3, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    twice = np.cross(b - a, c - a)
    length = np.linalg.norm(twice, axis=1)
    return length / 2, twice / length[:, None]


def _elements_of(cells: NDArray[np.int64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the element (f,) that each boundary face belongs to."""
    found = {}
    for left_out in range(4):
        for number, triple in enumerate(np.sort(np.delete(cells, left_out, axis=1), axis=1).tolist()):
            found[tuple(triple)] = number
    return np.array([found[tuple(triple)] for triple in np.sort(faces, axis=1).tolist()])


def _faces_away(
    nodes: NDArray[np.int64], normal: FloatArray, faces: NDArray[np.int64], count: int
) -> NDArray[np.bool_]:
    """Tell for each boundary face whether its node (f,) within the body lies on a side that looks the other way."""
    outward = np.zeros((count, 3))
    np.add.at(outward, faces.ravel(), np.repeat(normal, 3, axis=0))
    length = np.linalg.norm(outward, axis=1)
    unit = outward / np.where(length > 0, length, 1.0)[:, None]
    return np.asarray(np.einsum("fx,fx->f", unit[nodes], normal) < _OPPOSITE)
