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
from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.surface import boundary_faces
from estimator.geometry.bisection import TETRAHEDRON_EDGES, refine
from estimator.geometry.fitting import fitted
from estimator.geometry.grading import EdgeLengthField, EdgeLengths
from estimator.geometry.holds import HeldSurface, Region, hold_regions
from estimator.geometry.quality import MeshQuality, check_quality, measure_quality
from estimator.geometry.subdivision import halved_cells
from estimator.geometry.tetwild import ENVELOPE, tetrahedra_around
from estimator.surfaces.decimation import collapsed
from estimator.surfaces.queries import inside, nearest
from estimator.surfaces.surface import Surface, directed_edges

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_NOBODY = -1
_MOST_ELEMENTS = 1e6
# By how much of its envelope the surface may be simplified before; of the whole, meshes get twice the elements.
_SIMPLIFIED = 0.25
# Of the points where a mesh is compared with its surface, in edge lengths.
_SPACING = 0.5


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
    followed = [_simplified(surface, lengths).corners, *(hold.walls for hold in body.holds.values())]
    points, cells = tetrahedra_around(np.concatenate(followed), lengths.largest_m)
    points, cells = _compressed(points, cells[_in_tissue(body, points[cells].mean(axis=1))])
    _, held = _boundary(body, points, cells)
    points, cells = refine(points, cells, EdgeLengthField(points, held, lengths))
    return _on_body(points, cells, body, surface, lengths)


def halved(
    tissue: TissueMesh, surface: Surface, regions: Mapping[str, Region], lengths: EdgeLengths
) -> TissueMesh:
    """Return a mesh of tetrahedra of half the size, within those of a mesh but for the skin, which they follow closer.

    Parameters
    ----------
    tissue : the mesh that was made of the others, as :func:`tetrahedralise` does

    Raises
    ------
    InputError
        The result is bad.
    """
    body = hold_regions(surface, regions, reach_m=lengths.largest_m)
    points = tissue.mesh.points
    return _on_body(points, halved_cells(points, tissue.mesh.cells), body, surface, lengths)


def _on_body(
    points: FloatArray, cells: IntArray, body: HeldSurface, surface: Surface, lengths: EdgeLengths
) -> TissueMesh:
    """Move the boundary onto the body, judge the mesh, and raise it to second order."""
    free, held = _boundary(body, points, cells)
    points = fitted(points, cells, free, held, body)
    quality = measure_quality(points, cells, free, held, body, _SPACING * lengths.largest_m)
    check_quality(quality, envelope_m(lengths), surface)
    mesh, nodes = _quadratic(points, cells, held)
    rigid = {name: hold.core for name, hold in body.holds.items() if hold.core is not None}
    return TissueMesh(mesh, nodes, rigid, quality)


def _simplified(surface: Surface, lengths: EdgeLengths) -> Surface:
    """Return the surface with fewer triangles, well within what the mesher may leave it by.

    The mesher takes three times as long for triangles much smaller than its elements.
    """
    try:
        return collapsed(surface, _SIMPLIFIED * envelope_m(lengths), "the surface")
    except InputError:
        return surface


def envelope_m(lengths: EdgeLengths) -> float:
    """Return how far the mesher may leave the surface, m."""
    return ENVELOPE * lengths.largest_m


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


def _in_tissue(body: HeldSurface, points: FloatArray) -> BoolArray:
    """Tell which points (m, 3) lie in the tissue that is left."""
    left = inside(body.surface, points)
    for hold in body.holds.values():
        if hold.core is not None:
            left &= ~hold.core.contains(points)
    return left


def _boundary(body: HeldSurface, points: FloatArray, cells: IntArray) -> tuple[IntArray, dict[str, IntArray]]:
    """Return the boundary faces (f, 3) of the tissue that are free, and those that each region holds.

    A face belongs to what its centre is nearest to: a wall, or a triangle of the surface. Whether it lies on a patch
    tells its place that is farthest from the rim, for a narrow one along a bent rim has its centre on the other side.
    """
    faces = boundary_faces(Mesh(points, cells, "tet4"))
    corners = points[faces]
    centres = corners.mean(axis=1)
    triangles = np.flatnonzero(body.remaining)
    surface = body.surface.corners[triangles]
    _, foot = nearest(surface, centres)
    distance = np.linalg.norm(centres - foot, axis=1)
    holder = np.full(len(faces), _NOBODY)
    for number, hold in enumerate(body.holds.values()):
        if hold.core is None:
            triangle, _ = nearest(surface, _farthest_from(hold.walls, corners))
            holder[hold.patch[triangles[triangle]] & (holder == _NOBODY)] = number
            continue
        _, foot = nearest(hold.walls, centres)
        from_wall = np.linalg.norm(centres - foot, axis=1)
        holder[from_wall < distance] = number
        distance = np.minimum(distance, from_wall)
    held = {name: faces[holder == number] for number, name in enumerate(body.holds)}
    return faces[holder == _NOBODY], held


def _farthest_from(walls: FloatArray, corners: FloatArray) -> FloatArray:
    """Return of each triangle (f, 3, 3) the corner or the centre that is farthest from the walls, (f, 3)."""
    places = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1)
    if not len(walls):
        return places[:, -1]
    _, foot = nearest(walls, places.reshape(-1, 3))
    away = np.linalg.norm(places.reshape(-1, 3) - foot, axis=1).reshape(-1, 4)
    return np.take_along_axis(places, away.argmax(axis=1)[:, None, None], axis=1)[:, 0]


def _compressed(points: FloatArray, cells: IntArray) -> tuple[FloatArray, IntArray]:
    """Leave out the points that no cell uses."""
    used, renumbered = np.unique(cells, return_inverse=True)
    return points[used], renumbered.reshape(-1, 4)


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
