"""Reference elements: nodes, shape functions, quadrature and the space of the projected dilatation.

Hexahedra are tensor products of Lagrange polynomials on [−1, 1]; tetrahedra live on the unit simplex. The dilatation
J − 1 of a hexahedron of order p is projected onto the complete polynomials of degree p − 1, discontinuous between
elements: for p = 2 that is the Q2/P1 pair, which satisfies the inf-sup condition (Brezzi & Fortin 1991, VI.3.3) and
therefore neither locks nor oscillates as the Poisson's ratio tends to one half.
"""

from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Literal

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ElementKind = Literal["tet4", "tet10", "hex8", "hex27", "hex64"]

_HEX_ORDER = {"hex8": 1, "hex27": 2, "hex64": 3}


@dataclass(frozen=True)
class ReferenceElement:
    """An element at the points of its quadrature rule.

    Attributes
    ----------
    kind : name; the number is the number of nodes
    nodes : (k, 3) node positions in reference coordinates
    points, weights : (q, 3), (q,) quadrature rule
    shape : (q, k) shape functions
    gradient : (q, k, 3) their derivatives by the reference coordinates
    dilatation_basis : (q, r) functions onto which J − 1 is projected; r = 0 leaves it unprojected
    """

    kind: ElementKind
    nodes: FloatArray
    points: FloatArray
    weights: FloatArray
    shape: FloatArray
    gradient: FloatArray
    dilatation_basis: FloatArray


def evaluate(kind: ElementKind, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return shape functions (n, k) and their reference gradients (n, k, 3) at reference ``points`` (n, 3)."""
    if kind in _HEX_ORDER:
        return _evaluate_hexahedron(_HEX_ORDER[kind], points)
    return _evaluate_tetrahedron(kind, points)


@cache
def reference_element(kind: ElementKind) -> ReferenceElement:
    """Return the reference element of a kind with the quadrature that integrates its stiffness."""
    if kind in _HEX_ORDER:
        order = _HEX_ORDER[kind]
        abscissae, line_weights = leggauss(order + 1)
        points = np.array(list(product(abscissae, repeat=3)))
        weights = np.array([np.prod(w) for w in product(line_weights, repeat=3)])
        nodes = np.array(list(product(np.linspace(-1.0, 1.0, order + 1), repeat=3)))
        powers = [e for e in product(range(order), repeat=3) if sum(e) <= order - 1]
        basis = np.stack([np.prod(points ** np.array(e), axis=1) for e in powers], axis=1)
    else:
        points, weights = _tetrahedron_rule(kind)
        nodes = _tetrahedron_nodes(kind)
        basis = np.zeros((len(points), 0))
    shape, gradient = evaluate(kind, points)
    return ReferenceElement(kind, nodes, points, weights, shape, gradient, basis)


@cache
def _lagrange_coefficients(order: int) -> FloatArray:
    """Return the coefficients (order + 1, order + 1) of each Lagrange polynomial, by power and node."""
    nodes = np.linspace(-1.0, 1.0, order + 1)
    return np.asarray(np.linalg.inv(np.vander(nodes, increasing=True)))


def _lagrange(order: int, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the Lagrange polynomials on equidistant nodes of [−1, 1] and their derivatives, each (n, order + 1)."""
    coefficients = _lagrange_coefficients(order)
    powers = np.vander(x, order + 1, increasing=True)
    return powers @ coefficients, powers[:, :-1] @ (np.arange(1.0, order + 1)[:, None] * coefficients[1:])


def _evaluate_hexahedron(order: int, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    lines = [_lagrange(order, points[:, axis]) for axis in range(3)]
    count = (order + 1) ** 3

    def tensor(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
        return np.einsum("ni,nj,nk->nijk", x, y, z).reshape(len(points), count)

    values = [line[0] for line in lines]
    gradient = np.empty((len(points), count, 3))
    for axis in range(3):
        factors = list(values)
        factors[axis] = lines[axis][1]
        gradient[:, :, axis] = tensor(*factors)
    return tensor(*values), gradient


# The mid-edge node of a tet10 between each pair of corners (the order of VTK and of meshio).
_TET10_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


def _tetrahedron_nodes(kind: ElementKind) -> FloatArray:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    if kind == "tet4":
        return corners
    return np.vstack([corners, [(corners[a] + corners[b]) / 2 for a, b in _TET10_EDGES]])


def _evaluate_tetrahedron(kind: ElementKind, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    barycentric = np.column_stack([1.0 - points.sum(axis=1), points])
    corner_gradient = np.array([[-1.0, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    if kind == "tet4":
        return barycentric, np.broadcast_to(corner_gradient, (len(points), 4, 3)).copy()
    shape = np.empty((len(points), 10))
    gradient = np.empty((len(points), 10, 3))
    for a in range(4):
        shape[:, a] = barycentric[:, a] * (2 * barycentric[:, a] - 1)
        gradient[:, a] = (4 * barycentric[:, a] - 1)[:, None] * corner_gradient[a]
    for n, (a, b) in enumerate(_TET10_EDGES, start=4):
        shape[:, n] = 4 * barycentric[:, a] * barycentric[:, b]
        gradient[:, n] = 4 * (
            barycentric[:, a, None] * corner_gradient[b] + barycentric[:, b, None] * corner_gradient[a]
        )
    return shape, gradient


def _tetrahedron_rule(kind: ElementKind) -> tuple[FloatArray, FloatArray]:
    """Degree 1 for linear, degree 2 (four points) for quadratic tetrahedra; weights sum to the volume 1/6."""
    if kind == "tet4":
        return np.full((1, 3), 0.25), np.array([1 / 6])
    a, b = (5 - np.sqrt(5)) / 20, (5 + 3 * np.sqrt(5)) / 20
    return np.array([[a, a, a], [b, a, a], [a, b, a], [a, a, b]]), np.full(4, 1 / 24)
