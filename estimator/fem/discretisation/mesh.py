"""The mesh: points, cells of one kind, and where a material point lies in it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from estimator.errors import InputError
from estimator.fem.discretisation.elements import ElementKind, evaluate, reference_element

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# A point is looked for in so many elements, those whose centres are nearest; a reference coordinate is found once it
# moves by less.
_CANDIDATES = 32
_SETTLED = 1e-14


@dataclass(frozen=True)
class Mesh:
    """An unstructured mesh of one element kind.

    Attributes
    ----------
    points : (n, 3) float64, node positions at rest, tissue frame, m
    cells : (e, k) int64, nodes of each element in the order of :mod:`estimator.fem.discretisation.elements`
    kind : element kind
    """

    points: FloatArray
    cells: IntArray
    kind: ElementKind

    def describe(self) -> dict[str, int | str]:
        """Return node and element count and the kind, as reports print them."""
        return {"nodes": len(self.points), "elements": len(self.cells), "kind": self.kind}


def interpolation_rows(mesh: Mesh, positions: FloatArray, tolerance_m: float) -> tuple[IntArray, FloatArray]:
    """Locate material points in the mesh.

    A point that lies outside by no more than ``tolerance_m`` (a bead on a surface that the mesh facets) takes the
    nearest point of the nearest element.

    Parameters
    ----------
    mesh : Mesh
    positions : (m, 3) float64, tissue frame at rest, m
    tolerance_m : float

    Returns
    -------
    nodes : (m, k) int64, the nodes of the element that holds each point
    weights : (m, k) float64, its shape functions there

    Raises
    ------
    InputError
        A point lies farther than ``tolerance_m`` from the mesh; the message names it.
    """
    centres = mesh.points[mesh.cells].mean(axis=1)
    candidates = min(_CANDIDATES, len(mesh.cells))
    _, nearest = cKDTree(centres).query(positions, k=candidates)
    cells = np.reshape(nearest, -1)
    wanted = np.repeat(positions, candidates, axis=0)
    shape, _ = evaluate(mesh.kind, _to_reference(mesh, cells, wanted))
    off = _combined(shape, mesh.points[mesh.cells[cells]]) - wanted
    distance = np.linalg.norm(off, axis=1).reshape(len(positions), candidates)
    best = np.argmin(distance, axis=1)
    for row, position in enumerate(positions):
        if distance[row, best[row]] > tolerance_m:
            raise InputError(
                f"fiducial {row} at {np.round(position * 1e3, 2).tolist()} mm lies "
                f"{distance[row, best[row]] * 1e3:.2f} mm outside the meshed tissue; correct its rest position"
            )
    chosen = np.arange(len(positions)) * candidates + best
    return mesh.cells[cells[chosen]], shape[chosen]


def _to_reference(mesh: Mesh, cells: IntArray, positions: FloatArray) -> FloatArray:
    """Return the reference coordinates (c, 3) of positions (c, 3), each confined to its one of ``cells`` (c,)."""
    corners = mesh.points[mesh.cells[cells]]
    reference = np.tile(reference_element(mesh.kind).nodes.mean(axis=0), (len(cells), 1))
    moving = np.arange(len(cells))
    for _ in range(12):
        shape, gradient = evaluate(mesh.kind, reference[moving])
        residual = positions[moving] - _combined(shape, corners[moving])
        jacobian = corners[moving].swapaxes(1, 2) @ gradient
        step = np.linalg.solve(jacobian, residual[:, :, None])[:, :, 0]
        found = _confine(mesh.kind, reference[moving] + step)
        change = np.abs(found - reference[moving]).max(axis=1)
        reference[moving] = found
        moving = moving[change > _SETTLED]
    return reference


def _combined(shape: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the points (c, 3) at shape functions (c, k) of elements with nodes (c, k, 3)."""
    return np.asarray((shape[:, None, :] @ corners)[:, 0])


def _confine(kind: ElementKind, reference: FloatArray) -> FloatArray:
    if kind.startswith("hex"):
        return np.clip(reference, -1.0, 1.0)
    inside = np.clip(reference, 0.0, None)
    excess = np.clip(inside.sum(axis=1) - 1.0, 0.0, None)
    return np.clip(inside - excess[:, None] / 3, 0.0, 1.0)
