"""Serendipity hexahedra (20 nodes) of a block, graded towards the edges of what is held."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import felupe
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Vector = tuple[float, float, float]

ELEMENT = felupe.QuadraticHexahedron()
# 2 x 2 x 2 points: reduced for this element, which keeps it from locking near incompressibility.
_CELL_RULE = felupe.GaussLegendre(order=1, dim=3)
_FULL_RULE = felupe.GaussLegendre(order=2, dim=3)
_FACE_RULE = felupe.GaussLegendre(order=2, dim=2)
# A break closer than this to a face of the block makes no plane, m.
NEAREST_TO_A_FACE = 1e-4
_AXIS = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, slots=True)
class Break:
    """A coordinate along one axis that becomes a mesh plane, and the edge length wanted at it, m."""

    at: float
    edge: float


@dataclass(frozen=True, slots=True)
class Quadrature:
    """Shape functions and their gradients at the quadrature points of every cell.

    Attributes
    ----------
    shapes : (q, 20) shape functions
    points : (e, q, 3) where they lie at rest, m
    gradients : (e, q, 20, 3) of the shape functions by the coordinates at rest, 1/m
    volumes : (e, q) m³
    """

    shapes: FloatArray
    points: FloatArray
    gradients: FloatArray
    volumes: FloatArray


@dataclass(frozen=True, slots=True)
class Face:
    """Quadrature on the outer face of some cells.

    Attributes
    ----------
    cells : (k,) which cells
    shapes : (q, 20) shape functions of the cell at the points of the face
    points : (k, q, 3) where they lie at rest, m
    areas : (k, q) m²
    """

    cells: IntArray
    shapes: FloatArray
    points: FloatArray
    areas: FloatArray


@dataclass(frozen=True, slots=True)
class BrickMesh:
    """A mesh of a block.

    Attributes
    ----------
    grid : (n, 3) nodes before the block is reshaped, m; its planes are where the breaks say
    points : (n, 3) nodes at rest, m
    cells : (e, 20)
    """

    grid: FloatArray
    points: FloatArray
    cells: IntArray

    def without(self, cells: NDArray[np.bool_]) -> "BrickMesh":
        """Return the mesh without some of its cells (e,), and without the nodes that no other has."""
        used, renumbered = np.unique(self.cells[~cells], return_inverse=True)
        return BrickMesh(self.grid[used], self.points[used], renumbered.reshape(-1, self.cells.shape[1]))

    def quadrature(self) -> Quadrature:
        """Integrate over the cells by the rule that stress is evaluated by."""
        return self._integrate(_CELL_RULE)

    def unseen_gradients(self) -> FloatArray:
        """Return ∫ ∇Na·∇Nb dV of every cell by a full rule less that by the reduced one, (e, 20, 20) m.

        It is zero for every affine motion, and positive for the motions in which the reduced rule sees no strain.
        """
        full, reduced = (
            np.einsum("eqni,eqmi,eq->enm", q.gradients, q.gradients, q.volumes, optimize=True)
            for q in (self._integrate(_FULL_RULE), self._integrate(_CELL_RULE))
        )
        return full - reduced

    def _integrate(self, rule: felupe.quadrature.Scheme) -> Quadrature:
        shapes = np.array([ELEMENT.function(r) for r in rule.points])
        derivatives = np.array([ELEMENT.gradient(r) for r in rule.points])
        corners = self.points[self.cells]
        jacobian = np.einsum("eni,qnj->eqij", corners, derivatives)
        gradients = np.einsum("qnj,eqji->eqni", derivatives, np.linalg.inv(jacobian))
        volumes = np.linalg.det(jacobian) * rule.weights
        return Quadrature(shapes, np.einsum("qn,eni->eqi", shapes, corners), gradients, volumes)

    def face(self, axis: str, side: int) -> Face:
        """Integrate over the outer face across an axis (x, y, z), on its lower (-1) or upper (+1) side."""
        k = _AXIS[axis]
        extreme = self.grid[:, k].min() if side < 0 else self.grid[:, k].max()
        on_face = np.isclose(self.grid[:, k], extreme, atol=1e-9)
        cells = np.flatnonzero(on_face[self.cells].sum(axis=1) == 8)
        natural = np.insert(_FACE_RULE.points, k, float(side), axis=1)
        shapes = np.array([ELEMENT.function(r) for r in natural])
        derivatives = np.array([ELEMENT.gradient(r) for r in natural])
        corners = self.points[self.cells[cells]]
        jacobian = np.delete(np.einsum("eni,qnj->eqij", corners, derivatives), k, axis=3)
        normal = np.cross(jacobian[..., 0], jacobian[..., 1])
        areas = np.linalg.norm(normal, axis=2) * _FACE_RULE.weights
        return Face(cells, shapes, np.einsum("qn,eni->eqi", shapes, corners), areas)

    def locate(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Find points (m, 3) of the block: their cells (m,), and the shape functions there (m, 20).

        A point a little outside belongs to the nearest cell.
        """
        natural = np.zeros((len(points), len(self.cells), 3))
        corners = self.points[self.cells]
        for _ in range(8):
            shapes = ELEMENT.function(np.moveaxis(natural, 2, 0))
            derivatives = ELEMENT.gradient(np.moveaxis(natural, 2, 0))
            gap = points[:, None] - np.einsum("nme,eni->mei", shapes, corners)
            jacobian = np.einsum("eni,njme->meij", corners, derivatives)
            natural += np.linalg.solve(jacobian, gap[..., None])[..., 0]
            # Newton's steps outside the cell lead nowhere, and are of no use there either.
            natural = np.clip(natural, -2.0, 2.0)
        cells = np.argmin(np.abs(natural).max(axis=2), axis=1)
        inside = natural[np.arange(len(points)), cells]
        return cells, np.array([ELEMENT.function(r) for r in inside]).reshape(
            len(points), self.cells.shape[1]
        )


def brick_mesh(
    size: Vector,
    breaks: tuple[Sequence[Break], Sequence[Break], Sequence[Break]],
    largest: float,
    growth: float,
    layers: int,
    reshape: Callable[[FloatArray], FloatArray] | None = None,
) -> BrickMesh:
    """Mesh a block of edges ``size`` (m), centred at the origin.

    Parameters
    ----------
    breaks : planes across x, y, z with the edge length wanted at each
    largest : edge length far from all of them, m
    growth : by which edges lengthen with the distance from a break, m per m
    layers : smallest number of cells through the thickness
    reshape : moves the nodes (n, 3) of the block to where they lie at rest
    """
    lines = [
        _graded_line(-length / 2, length / 2, own, largest, growth)
        for length, own in zip(size[:2], breaks[:2], strict=True)
    ]
    lines.append(_graded_line(-size[2] / 2, size[2] / 2, breaks[2], size[2] / layers, growth))
    mesh = felupe.mesh.Grid(*lines).add_midpoints_edges()
    grid = np.asarray(mesh.points, dtype=np.float64)
    points = grid if reshape is None else reshape(grid)
    return BrickMesh(grid, points, np.asarray(mesh.cells, dtype=np.int64))


def _graded_line(
    lower: float, upper: float, breaks: Sequence[Break], largest: float, growth: float
) -> FloatArray:
    inner = [b for b in breaks if lower - 1e-9 <= b.at <= upper + 1e-9]
    first, last = lower + NEAREST_TO_A_FACE, upper - NEAREST_TO_A_FACE
    planes = np.unique(np.round([lower, *(b.at for b in inner if first < b.at < last), upper], 9))
    samples = np.linspace(lower, upper, 4001)
    wanted = np.full(len(samples), largest)
    for b in inner:
        wanted = np.minimum(wanted, b.edge + growth * np.abs(samples - b.at))
    cells = np.concatenate([[0.0], np.cumsum(np.diff(samples) * (1 / wanted[1:] + 1 / wanted[:-1]) / 2)])
    lines = [np.array([lower])]
    for start, end in pairwise(planes):
        before, after = np.interp([start, end], samples, cells)
        count = max(int(np.ceil(after - before - 0.2)), 1)
        inside = np.interp(np.linspace(before, after, count + 1)[1:], cells, samples)
        inside[-1] = end
        lines.append(inside)
    return np.concatenate(lines)
