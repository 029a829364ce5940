"""The assembled tangent: a fixed sparsity pattern, and a sparse Cholesky factor that reuses its symbolic analysis.

Degrees of freedom are numbered free first, then gripped; anchored ones are left out. Only the lower triangle is kept.
Small matrices are factorised in CHOLMOD's own order of elimination, a minimum degree one, which is as good there.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from kvxopt import cholmod, matrix, spmatrix
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu

from estimator.fem.assembly.dissection import nested_dissection
from estimator.fem.assembly.following import FollowingFactor
from estimator.fem.assembly.kernels import gather
from estimator.fem.assembly.sorting import order_by
from estimator.fem.discretisation.mesh import Mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Up to so many unknowns patterns and analyses outlive what uses them; those of larger problems would hold too much
# memory.
_KEPT = 10_000


@dataclass(frozen=True)
class TangentPattern:
    """Where each element entry goes.

    Attributes
    ----------
    free, gripped : (nf,), (ng,) int64, degrees of freedom (3·node + axis) in the order of the matrix
    rows, columns : (z,) int64, matrix entries of the lower triangle, by columns
    start, source : ``gather`` lists of the element entries that each matrix entry sums
    elimination : (nf,) int64, the order in which free degrees of freedom are eliminated; None for CHOLMOD's own
    """

    free: IntArray
    gripped: IntArray
    rows: IntArray
    columns: IntArray
    start: IntArray
    source: IntArray
    elimination: IntArray | None = None


def tangent_pattern(
    cells: IntArray, fixed: NDArray[np.bool_], gripped: NDArray[np.bool_], points: FloatArray | None = None
) -> TangentPattern:
    """Analyse elements (e, k) whose degrees of freedom (n, 3) stand still or are gripped; gripped ones win.

    With the nodes' ``points`` (n, 3) the elimination goes by nested dissection.
    """
    kind = np.where(gripped, 1, np.where(fixed, 2, 0)).ravel()
    free_dofs, gripped_dofs = np.flatnonzero(kind == 0), np.flatnonzero(kind == 1)
    number = np.full(len(kind), -1)
    number[free_dofs] = np.arange(len(free_dofs))
    number[gripped_dofs] = len(free_dofs) + np.arange(len(gripped_dofs))
    dofs = number[(3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), -1)]
    size = dofs.shape[1]
    lower_row, lower_column = np.tril_indices(size)
    row = np.maximum(dofs[:, lower_row], dofs[:, lower_column])
    column = np.minimum(dofs[:, lower_row], dofs[:, lower_column])
    source = np.arange(len(dofs))[:, None] * size * size + lower_row * size + lower_column
    kept = column >= 0
    row, column, source = row[kept], column[kept], source[kept]
    order = order_by(column, row, len(free_dofs) + len(gripped_dofs))
    row, column = row[order], column[order]
    begins = np.concatenate([[True], (np.diff(row) != 0) | (np.diff(column) != 0)])[: len(order)]
    return TangentPattern(
        free_dofs,
        gripped_dofs,
        row[begins],
        column[begins],
        np.append(np.flatnonzero(begins), len(order)),
        source[order],
        None if points is None else _elimination(cells, points, free_dofs),
    )


def _elimination(cells: IntArray, points: FloatArray, free_dofs: IntArray) -> IntArray:
    turn = np.empty(len(points), dtype=np.int64)
    turn[nested_dissection(points, cells)] = np.arange(len(points))
    return np.argsort(turn[free_dofs // 3], kind="stable").astype(np.int64)


def shared_pattern(mesh: Mesh, fixed: NDArray[np.bool_], gripped: NDArray[np.bool_]) -> TangentPattern:
    """Return the pattern of a mesh with its degrees of freedom held so, analysed once for all problems that have it.

    Small ones are kept beyond that: every hypothesis of a diagnosis poses another problem with one of a few patterns.
    """
    key = (mesh.cells.tobytes(), mesh.cells.shape[1], fixed.tobytes(), gripped.tobytes())
    if fixed.size <= _KEPT:
        return _kept_pattern(key)
    found = _patterns_in_use.get(key)
    if found is None:
        found = _patterns_in_use[key] = tangent_pattern(mesh.cells, fixed, gripped, mesh.points)
    return found


# Nodes of the elements and how many each has, and which degrees of freedom are fixed and gripped.
_Key: TypeAlias = tuple[bytes, int, bytes, bytes]
_patterns_in_use: weakref.WeakValueDictionary[_Key, TangentPattern] = weakref.WeakValueDictionary()


@lru_cache(maxsize=8)
def _kept_pattern(key: _Key) -> TangentPattern:
    cells, nodes, fixed, gripped = key
    return tangent_pattern(
        np.frombuffer(cells, dtype=np.int64).reshape(-1, nodes),
        np.frombuffer(fixed, dtype=np.bool_),
        np.frombuffer(gripped, dtype=np.bool_),
    )


class CholeskyFactor:
    """A CHOLMOD factor of a symmetric positive definite matrix."""

    def __init__(self, symbolic: object) -> None:
        self._factor = symbolic

    def solve(self, right_hand_sides: FloatArray) -> FloatArray:
        """Solve for (n,) or (n, m) right-hand sides."""
        unknowns = matrix(np.asfortranarray(right_hand_sides.reshape(len(right_hand_sides), -1)))
        cholmod.solve(self._factor, unknowns)
        return np.array(unknowns).reshape(right_hand_sides.shape)


class IndefiniteFactor:
    """An LU factor, made when it is first used: most indefinite tangents are only looked at and left."""

    def __init__(self, values: csc_array) -> None:
        self._values = values
        self._factor: SuperLU | None = None

    def solve(self, right_hand_sides: FloatArray) -> FloatArray:
        """Solve for (n,) or (n, m) right-hand sides."""
        if self._factor is None:
            self._factor = splu(self._values, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01)
        return np.asarray(self._factor.solve(right_hand_sides))


@dataclass(frozen=True)
class Tangent:
    """An assembled tangent.

    Attributes
    ----------
    free : factor of the block of the free degrees of freedom, (nf, nf)
    gripped_free : (ng, nf) block: forces on the gripped nodes from free displacements
    gripped : (ng, ng) block of the gripped nodes
    """

    free: CholeskyFactor | IndefiniteFactor | FollowingFactor
    gripped_free: csc_array
    gripped: csc_array

    @property
    def positive_definite(self) -> bool:
        """False where the state is no stable equilibrium."""
        factor = self.free.base if isinstance(self.free, FollowingFactor) else self.free
        return isinstance(factor, CholeskyFactor)

    def with_following(self, along: csr_array, by: csr_array) -> Tangent:
        """Return the tangent with forces along (nf, r) that follow those ``by`` (r, ng) on the gripped nodes."""
        if isinstance(self.free, FollowingFactor) or not along.shape[1]:
            return self
        return replace(self, free=FollowingFactor(self.free, along, csr_array(by @ self.gripped_free)))


class TangentAssembler:
    """Assembles and factorises tangents of one pattern. It reuses its buffers: one assembler a thread."""

    def __init__(self, pattern: TangentPattern) -> None:
        free, gripped = len(pattern.free), len(pattern.gripped)
        self._pattern = pattern
        self._shape = (free, gripped)
        self._in_free = np.flatnonzero(pattern.rows < free)
        self._in_mixed = np.flatnonzero((pattern.rows >= free) & (pattern.columns < free))
        self._in_gripped = np.flatnonzero(pattern.columns >= free)
        rows, columns = pattern.rows[self._in_free], pattern.columns[self._in_free]
        self._free_entries = (rows, columns)
        self._matrix = spmatrix(1.0, matrix(rows), matrix(columns), (free, free))
        self._elimination = None if pattern.elimination is None else matrix(pattern.elimination)
        self._mixed_rows = pattern.rows[self._in_mixed] - free
        small = free <= _KEPT
        self._spare = _spare_analyses(free, columns.tobytes(), rows.tobytes()) if small else []
        self._mixed_start = np.searchsorted(pattern.columns[self._in_mixed], np.arange(free + 1))
        self._node_blocks, self._node_entries = _node_entries(pattern)

    def assemble(self, element_stiffness: FloatArray, node_stiffness: FloatArray | None = None) -> Tangent:
        """Assemble element matrices (e, 3k, 3k) and node blocks (n, 3, 3), and factorise the free block.

        Of both the lower triangle counts.
        """
        pattern, (free, gripped) = self._pattern, self._shape
        values = gather(pattern.start, pattern.source, element_stiffness.reshape(-1))
        del element_stiffness
        if node_stiffness is not None:
            values[self._node_entries] += node_stiffness[self._node_blocks]
        mixed = csc_array(
            (values[self._in_mixed], self._mixed_rows, self._mixed_start), shape=(gripped, free)
        )
        held = self._in_gripped
        corner = _symmetric(values[held], pattern.rows[held] - free, pattern.columns[held] - free, gripped)
        self._matrix.V = matrix(values[self._in_free])
        symbolic = self._analysis()
        try:
            cholmod.numeric(self._matrix, symbolic)
            # A supernodal factorisation that failed says so only when it is used or looked at.
            cholmod.diag(symbolic)
        except (ArithmeticError, ValueError):
            self._spare.append(symbolic)
            whole = _symmetric(values[self._in_free], *self._free_entries, free)
            return Tangent(IndefiniteFactor(whole), mixed, corner)
        factor = CholeskyFactor(symbolic)
        weakref.finalize(factor, self._spare.append, symbolic)
        return Tangent(factor, mixed, corner)

    def _analysis(self) -> object:
        """Return an analysis whose numeric factor nobody holds any more, or a new one."""
        try:
            return self._spare.pop()
        except IndexError:
            given = {} if self._elimination is None else {"p": self._elimination}
            return cholmod.symbolic(self._matrix, **given)


@lru_cache(maxsize=2)
def _spare_analyses(size: int, columns: bytes, rows: bytes) -> list[object]:
    """Return the symbolic analyses of a small matrix that outlive their assembler: a refit makes one at every point."""
    return []


def _node_entries(pattern: TangentPattern) -> tuple[tuple[IntArray, IntArray, IntArray], IntArray]:
    """Return where the lower triangles of nodes' blocks (n, 3, 3) are, but for what stands still, and their entries.

    Of a node that is held along some axes and free along others the numbers are not in the order of the axes.
    """
    dofs = np.concatenate([pattern.free, pattern.gripped])
    number = np.full(3 * (int(dofs.max()) // 3 + 1), -1)
    number[dofs] = np.arange(len(dofs))
    first, second = np.tril_indices(3)
    node = np.repeat(np.unique(dofs // 3), len(first))
    one, other = np.tile(first, len(node) // len(first)), np.tile(second, len(node) // len(first))
    a, b = number[3 * node + one], number[3 * node + other]
    kept = (a >= 0) & (b >= 0)
    key = pattern.columns * len(dofs) + pattern.rows
    wanted = np.minimum(a, b)[kept] * len(dofs) + np.maximum(a, b)[kept]
    return (node[kept], one[kept], other[kept]), np.searchsorted(key, wanted)


def _symmetric(values: FloatArray, rows: IntArray, columns: IntArray, size: int) -> csc_array:
    below = rows != columns
    return csc_array(
        coo_array(
            (
                np.concatenate([values, values[below]]),
                (np.concatenate([rows, columns[below]]), np.concatenate([columns, rows[below]])),
            ),
            shape=(size, size),
        )
    )
