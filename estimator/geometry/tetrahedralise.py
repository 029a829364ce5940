"""From a surface and the regions that hold it to a mesh of quadratic tetrahedra.

fTetWild makes tetrahedra of even size; bisection then grades them towards the rims of the held regions. Tissue that a
region holds entirely moves rigidly and is left out, as in a block's mesh.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment import Box
from estimator.fem.mesh import Mesh
from estimator.geometry.bisection import TETRAHEDRON_EDGES, refine
from estimator.geometry.fitting import fitted
from estimator.geometry.grading import EdgeLengthField, EdgeLengths
from estimator.geometry.holds import HeldSurface, Region, hold_regions
from estimator.geometry.quality import MeshQuality, check_quality, measure_quality
from estimator.geometry.queries import inside, nearest
from estimator.geometry.surface import Surface, directed_edges
from estimator.geometry.tetwild import tetrahedra_around

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

# Whose a tetrahedron is: nobody's, the deformable tissue's, or from here on the regions' in their order.
_OUTSIDE, _TISSUE, _REGION = -1, 0, 1
_MOST_ELEMENTS = 1e6
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


@dataclass(frozen=True, eq=False)
class TissueMesh:
    """The deformable tissue.

    Attributes
    ----------
    mesh : Mesh, tet10 with straight edges
    held : for each region the nodes that it holds, (n,) bool
    rigid : the boxes of the regions whose tissue is left out
    quality : MeshQuality
    """

    mesh: Mesh
    held: Mapping[str, BoolArray]
    rigid: Mapping[str, Box]
    quality: MeshQuality


def tetrahedralise(surface: Surface, regions: Mapping[str, Region], lengths: EdgeLengths) -> TissueMesh:
    """Mesh the tissue that a surface encloses; no two calls give the same mesh.

    Parameters
    ----------
    surface : Surface
    regions : held ones, by name; they do not overlap
    lengths : edge lengths

    Raises
    ------
    InputError
        The edge lengths are out of proportion, a region holds no tissue or all of it, meshing fails, or its
        result is bad.
    """
    _check_lengths(surface, lengths)
    body = hold_regions(surface, regions, reach_m=lengths.largest_m)
    followed = [body.surface.corners[body.remaining], *(hold.walls for hold in body.holds.values())]
    points, cells = tetrahedra_around(np.concatenate(followed), lengths.largest_m)
    owner = _owners(body, points[cells].mean(axis=1))
    _, held = _boundary(body, points, cells, owner)
    wanted = EdgeLengthField(points, held, lengths)
    points, cells, parent = refine(points, cells, wanted, owner == _TISSUE)
    free, held = _boundary(body, points, cells, owner[parent])
    cells = cells[owner[parent] == _TISSUE]
    points, cells, free, held = _compressed(points, cells, free, held)
    points = fitted(points, cells, free, held, body)
    quality = measure_quality(points, cells, free, held, body)
    check_quality(quality)
    mesh, nodes = _quadratic(points, cells, held)
    rigid = {name: hold.core for name, hold in body.holds.items() if hold.core is not None}
    return TissueMesh(mesh, nodes, rigid, quality)


def _check_lengths(surface: Surface, lengths: EdgeLengths) -> None:
    smallest = min([lengths.largest_m, *lengths.rims_m.values()])
    if not (smallest > 0 and lengths.largest_m <= surface.diagonal_m):
        raise InputError(
            f"an edge length of {smallest:g} m on a phantom of {surface.diagonal_m:.3g} m across; "
            "give one above 0 and below that, in metres"
        )
    # A regular tetrahedron of edge h has the volume h³ / 6√2.
    expected = surface.volume_m3 * 6 * np.sqrt(2) / lengths.largest_m**3
    if expected > _MOST_ELEMENTS:
        raise InputError(
            f"an edge length of {lengths.largest_m:g} m gives about {expected:.1g} elements; "
            f"give a larger one, for at most {_MOST_ELEMENTS:.1g}"
        )


def _owners(body: HeldSurface, centres: FloatArray) -> IntArray:
    owner = np.where(inside(body.surface, centres), _TISSUE, _OUTSIDE)
    for number, hold in enumerate(body.holds.values()):
        if hold.core is not None:
            owner[hold.core.contains(centres)] = _REGION + number
    return owner


def _boundary(
    body: HeldSurface, points: FloatArray, cells: IntArray, owner: IntArray
) -> tuple[IntArray, dict[str, IntArray]]:
    """Return the faces (f, 3) of the tissue that are free, and those that each region holds, seen from outside."""
    tissue = owner == _TISSUE
    faces = cells[:, _FACES].reshape(-1, 3)
    order = np.lexsort(np.sort(faces, axis=1).T)
    key = np.sort(faces, axis=1)[order]
    number = np.empty(len(faces), dtype=np.int64)
    number[order] = np.append(0, np.cumsum(np.any(key[1:] != key[:-1], axis=1)))
    of_face = np.repeat(owner, 4)
    beyond = np.full(number.max() + 1, _OUTSIDE)
    np.maximum.at(beyond, number, np.where(of_face == _TISSUE, _OUTSIDE, of_face))
    sides = np.bincount(number, np.repeat(tissue, 4))
    bounding = np.flatnonzero(np.repeat(tissue, 4) & (sides[number] == 1))
    holder = beyond[number[bounding]]
    bounding = faces[bounding]
    on_surface = np.flatnonzero(holder == _OUTSIDE)
    triangle, _ = nearest(body.surface.corners, points[bounding[on_surface]].mean(axis=1))
    for index, hold in enumerate(body.holds.values()):
        if hold.core is None:
            holder[on_surface[hold.patch[triangle]]] = _REGION + index
    held = {name: bounding[holder == _REGION + index] for index, name in enumerate(body.holds)}
    return bounding[holder == _OUTSIDE], held


def _compressed(
    points: FloatArray, cells: IntArray, free: IntArray, held: Mapping[str, IntArray]
) -> tuple[FloatArray, IntArray, IntArray, dict[str, IntArray]]:
    """Leave out the points that no cell uses."""
    used, renumbered = np.unique(cells, return_inverse=True)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    renamed = {name: number[faces] for name, faces in held.items()}
    return points[used], renumbered.reshape(-1, 4), number[free], renamed


def _quadratic(
    points: FloatArray, cells: IntArray, held: Mapping[str, IntArray]
) -> tuple[Mesh, dict[str, BoolArray]]:
    """Put a node in the middle of every edge; it is held where its edge belongs to a held face."""
    count = len(points)
    ends = np.sort(cells[:, TETRAHEDRON_EDGES], axis=2).reshape(-1, 2)
    edges, number = np.unique(ends[:, 0] * count + ends[:, 1], return_inverse=True)
    middle = points[np.stack(np.divmod(edges, count), axis=1)].mean(axis=1)
    mesh = Mesh(np.vstack([points, middle]), np.hstack([cells, count + number.reshape(-1, 6)]), "tet10")
    nodes = {}
    for name, faces in held.items():
        low, high = np.sort(directed_edges(faces), axis=1).T
        nodes[name] = np.zeros(len(mesh.points), dtype=bool)
        nodes[name][faces] = True
        nodes[name][count + np.searchsorted(edges, low * count + high)] = True
    return mesh, nodes
