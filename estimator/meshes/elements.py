"""Volumes of elements, and their nodes put in order: no element stays folded, inside out, or there twice."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.fem.discretisation.elements import ElementKind, reference_element
from estimator.meshes.volume_mesh import MIRRORED, TETRAHEDRON_EDGES, CellKind, FoundMesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

# Wedges and pyramids are hexahedra with corners that coincide.
_AS_HEXAHEDRON: Mapping[CellKind, tuple[int, ...]] = {
    "hex8": (0, 1, 2, 3, 4, 5, 6, 7),
    "wedge6": (0, 1, 2, 2, 3, 4, 5, 5),
    "pyramid5": (0, 1, 2, 3, 4, 4, 4, 4),
}
# A hexahedron's corners in the order of its tensor product.
_TENSOR = (0, 4, 3, 7, 1, 5, 2, 6)
# No coordinate is as large, in any unit.
_FARTHEST = 1e12
# An element of less than this share of the cube of its size has no volume.
_FLAT = 1e-12
# Elements whose centres are closer than this share of the mesh's size fill the same space.
_SAME_PLACE = 1e-9


def point_volumes(points: FloatArray, kind: CellKind, cells: IntArray) -> FloatArray:
    """Return the volume (e, q) of the integration points of elements (e, k), by the Jacobian of shape functions."""
    element_kind: ElementKind = "hex8"
    if kind in ("tet4", "tet10"):
        element_kind = "tet4" if kind == "tet4" else "tet10"
        corners = points[cells]
    else:
        corners = points[cells[:, np.array(_AS_HEXAHEDRON[kind])[list(_TENSOR)]]]
    element = reference_element(element_kind)
    jacobian = np.einsum("ekx,qkr->eqxr", corners, element.gradient, optimize=True)
    return np.asarray(np.linalg.det(jacobian) * element.weights)


def in_order(found: FoundMesh, source: str) -> tuple[FoundMesh, tuple[str, ...]]:
    """Return a mesh whose elements are each there once, with positive volume and nodes in order, and what was done.

    Raises
    ------
    InputError
        There are no elements, an element names a node that there is not, is folded or has no volume, or two fill the
        same space; the message names the first one.
    """
    if not found.blocks or not any(len(cells) for cells in found.blocks.values()):
        raise InputError(
            f"{source}: holds no volume elements; save the mesh with its tetrahedra or hexahedra"
        )
    _check_numbers(found, source)
    found, remarks = _once(found)
    blocks = {}
    for kind, cells in found.blocks.items():
        ordered, told = _ordered(found.points, kind, cells, source)
        blocks[kind] = ordered
        remarks += told
    found = replace(found, blocks=blocks)
    _check_apart(found, source)
    return found, remarks


def _check_numbers(found: FoundMesh, source: str) -> None:
    placed = np.asarray((np.abs(found.points) < _FARTHEST).all(axis=1))
    if not placed.all():
        bad = int(np.argmin(placed))
        raise InputError(f"{source}: node {bad} (from 0) has no finite place; save the mesh again")
    for kind, cells in found.blocks.items():
        wrong = (cells < 0) | (cells >= len(found.points))
        if wrong.any():
            bad = int(np.argmax(wrong.any(axis=1)))
            raise InputError(
                f"{source}: element {bad} (from 0) of kind {kind} names a node that there is not; save the mesh again"
            )


def _once(found: FoundMesh) -> tuple[FoundMesh, tuple[str, ...]]:
    """Leave out elements with the same nodes as one before them, which keeps the regions of all of them."""
    blocks, remarks = {}, list[str]()
    members = {name: dict(inside) for name, inside in found.regions.items()}
    for kind, cells in found.blocks.items():
        _, first, which = np.unique(np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True)
        if len(first) < len(cells):
            remarks.append(f"left out {len(cells) - len(first)} {kind} that stand there twice")
        order = np.argsort(first)
        blocks[kind] = cells[first[order]]
        for inside in members.values():
            if kind in inside:
                any_of = np.zeros(len(first), dtype=bool)
                np.logical_or.at(any_of, which.reshape(-1), inside[kind])
                inside[kind] = any_of[order]
    return replace(found, blocks=blocks, regions=members), tuple(remarks)


def _ordered(
    points: FloatArray, kind: CellKind, cells: IntArray, source: str
) -> tuple[IntArray, tuple[str, ...]]:
    """Return elements with their middle nodes between their corners, and none inside out."""
    remarks = list[str]()
    if kind == "tet10":
        cells, moved = _middles_in_place(points, cells, source)
        if moved:
            remarks.append(f"put the middle nodes of {moved} tet10 in order")
    volumes = point_volumes(points, kind, cells)
    size = np.ptp(points[cells], axis=1).max(axis=1)
    over: BoolArray = np.asarray((volumes < 0).all(axis=1))
    whole: BoolArray = np.asarray(np.abs(volumes.sum(axis=1)) > _FLAT * size**3)
    bad: BoolArray = np.asarray(~((over | (volumes > 0).all(axis=1)) & whole))
    if bad.any():
        number = int(np.argmax(bad))
        place = np.round(points[cells[number]].mean(axis=0), 6).tolist()
        raise InputError(
            f"{source}: {np.count_nonzero(bad)} {kind} are {'folded' if whole[number] else 'without volume'}, the "
            f"first number {number} (from 0) about {place}; mend the mesh where it was made"
        )
    if over.any():
        cells = np.where(over[:, None], cells[:, MIRRORED[kind]], cells)
        which = "all" if over.all() else f"{np.count_nonzero(over)}"
        remarks.append(f"turned {which} {kind}, which were inside out")
    return cells, tuple(remarks)


def _middles_in_place(points: FloatArray, cells: IntArray, source: str) -> tuple[IntArray, int]:
    """Return tet10 (e, 10) with each middle node where the edge is that it lies at, and how many had others."""
    corners = points[cells[:, :4]]
    edges = np.array(TETRAHEDRON_EDGES)
    middles = corners[:, edges].mean(axis=2)
    away = np.linalg.norm(points[cells[:, 4:]][:, :, None] - middles[:, None], axis=3)
    edge_of = np.argmin(away, axis=2)
    moved = (edge_of != np.arange(6)).any(axis=1)
    # on strongly curved elements a node may be nearer to another edge, though all are in order
    mixed = moved & (np.sort(edge_of, axis=1) != np.arange(6)).any(axis=1)
    moved &= ~mixed
    if mixed.any() and (point_volumes(points, "tet10", cells[mixed]).min(axis=1) < 0).any():
        number = int(np.argmax(mixed))
        raise InputError(
            f"{source}: the middle nodes of tet10 number {number} (from 0) do not lie at its edges; save it again"
        )
    ordered = cells.copy()
    rows = np.flatnonzero(moved)
    ordered[rows[:, None], 4 + edge_of[rows]] = cells[rows, 4:]
    return ordered, len(rows)


def _check_apart(found: FoundMesh, source: str) -> None:
    """Refuse elements in one place: a body that was written twice, with nodes of its own each time."""
    centres = np.concatenate([found.points[cells].mean(axis=1) for cells in found.blocks.values()])
    size = float(np.ptp(found.points, axis=0).max())
    rounded = np.round((centres - centres.min(axis=0)) / (_SAME_PLACE * size)).astype(np.int64)
    _, first, counts = np.unique(rounded, axis=0, return_index=True, return_counts=True)
    if (counts > 1).any():
        place = np.round(centres[first[np.argmax(counts > 1)]], 6).tolist()
        raise InputError(
            f"{source}: {int((counts - 1).sum())} elements fill the space of others, the first about {place}; the body "
            "is there twice: save it once"
        )
