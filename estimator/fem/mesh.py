"""The mesh: points, cells of one kind, and where a material point lies in it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from estimator.errors import InputError
from estimator.fem.elements import ElementKind, evaluate, reference_element

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Mesh:
    """An unstructured mesh of one element kind.

    Attributes
    ----------
    points : (n, 3) float64, node positions at rest, tissue frame, m
    cells : (e, k) int64, nodes of each element in the order of :mod:`estimator.fem.elements`
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
    candidates = min(32, len(mesh.cells))
    _, nearest = cKDTree(centres).query(positions, k=candidates)
    nearest = np.reshape(nearest, (len(positions), candidates))
    nodes = np.empty((len(positions), mesh.cells.shape[1]), dtype=np.int64)
    weights = np.empty((len(positions), mesh.cells.shape[1]))
    for row, position in enumerate(positions):
        cells = nearest[row]
        reference = _to_reference(mesh, cells, position)
        shape, _ = evaluate(mesh.kind, reference)
        distance = np.linalg.norm(
            np.einsum("ck,ckx->cx", shape, mesh.points[mesh.cells[cells]]) - position, axis=1
        )
        best = int(np.argmin(distance))
        if distance[best] > tolerance_m:
            raise InputError(
                f"fiducial {row} at {np.round(position * 1e3, 2).tolist()} mm lies "
                f"{distance[best] * 1e3:.2f} mm outside the meshed tissue; correct its rest position"
            )
        nodes[row], weights[row] = mesh.cells[cells[best]], shape[best]
    return nodes, weights


def _to_reference(mesh: Mesh, cells: IntArray, position: FloatArray) -> FloatArray:
    """Return the reference coordinates of ``position`` in each of ``cells``, confined to the element, (c, 3)."""
    corners = mesh.points[mesh.cells[cells]]
    element = reference_element(mesh.kind)
    reference = np.tile(element.nodes.mean(axis=0), (len(cells), 1))
    for _ in range(12):
        shape, gradient = evaluate(mesh.kind, reference)
        residual = position - np.einsum("ck,ckx->cx", shape, corners)
        jacobian = np.einsum("ckx,ckr->cxr", corners, gradient)
        step = np.linalg.solve(jacobian, residual[:, :, None])[:, :, 0]
        reference = _confine(mesh.kind, reference + step)
    return reference


def _confine(kind: ElementKind, reference: FloatArray) -> FloatArray:
    if kind.startswith("hex"):
        return np.clip(reference, -1.0, 1.0)
    inside = np.clip(reference, 0.0, None)
    excess = np.clip(inside.sum(axis=1) - 1.0, 0.0, None)
    return np.clip(inside - excess[:, None] / 3, 0.0, 1.0)
