"""In which order a large tangent is eliminated, and how its entries are sorted."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from estimator.fem.assembly.dissection import nested_dissection
from estimator.fem.assembly.sorting import order_by
from estimator.fem.assembly.tangent import TangentAssembler, tangent_pattern


def grid(*counts: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and the cells of eight corners of a grid with so many points along each axis."""
    number = np.arange(np.prod(counts)).reshape(counts)
    points = np.stack(np.meshgrid(*(np.arange(n, dtype=float) for n in counts), indexing="ij"), axis=-1)
    corner = [
        number[
            i : counts[0] - 1 + i,
            j : counts[1] - 1 + j,
            k : counts[2] - 1 + k,
        ].ravel()
        for i in (0, 1)
        for j in (0, 1)
        for k in (0, 1)
    ]
    return points.reshape(-1, 3), np.column_stack(corner)


def filled(cells: np.ndarray, order: np.ndarray, permutation: str = "NATURAL") -> int:
    """How many entries the factor has where nodes that share a cell are joined."""
    turn = np.empty(len(order), dtype=int)
    turn[order] = np.arange(len(order))
    pairs = turn[cells]
    row = np.repeat(pairs, pairs.shape[1], axis=1).ravel()
    column = np.tile(pairs, pairs.shape[1]).ravel()
    joined = csc_array((-np.ones(len(row)), (row, column)), shape=(len(order),) * 2)
    joined.sum_duplicates()
    joined.setdiag(np.asarray(abs(joined).sum(axis=0)).ravel() + 1.0)
    factor = splu(joined, permc_spec=permutation, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return int(factor.L.nnz)


@given(st.tuples(*[st.integers(2, 6)] * 3), st.integers(1, 30))
def test_every_node_is_eliminated_once(counts, leaf) -> None:
    points, cells = grid(*counts)
    assert sorted(nested_dissection(points, cells, leaf)) == list(range(len(points)))


def test_nodes_without_a_place_of_their_own_are_eliminated_too() -> None:
    """Nothing can be cut where all points are one."""
    points, cells = grid(4, 4, 4)
    assert sorted(nested_dissection(0.0 * points, cells, 5)) == list(range(len(points)))


def test_the_factor_of_a_cube_fills_less_than_in_a_minimum_degree_order() -> None:
    points, cells = grid(18, 18, 18)
    natural = np.arange(len(points))
    by_dissection = filled(cells, nested_dissection(points, cells))
    assert by_dissection < 0.8 * filled(cells, natural, "MMD_AT_PLUS_A")
    assert by_dissection < 0.5 * filled(cells, natural)


@pytest.mark.parametrize("dissected", [False, True])
def test_either_order_of_elimination_solves_the_same_equations(dissected) -> None:
    points, cells = grid(5, 4, 3)
    fixed, gripped = np.zeros((2, len(points), 3), dtype=bool)
    fixed[points[:, 0] == 0.0], gripped[points[:, 0] == 4.0] = True, True
    pattern = tangent_pattern(cells, fixed, gripped, points if dissected else None)
    rng = np.random.default_rng(1)
    roots = rng.normal(size=(len(cells), 24, 24))
    tangent = TangentAssembler(pattern).assemble(roots @ roots.swapaxes(1, 2) + 10.0 * np.eye(24))
    load = rng.normal(size=(len(pattern.free), 2))
    whole = np.zeros((3 * len(points), 3 * len(points)))
    for element, root in zip(cells, roots, strict=True):
        dofs = (3 * element[:, None] + np.arange(3)).ravel()
        whole[np.ix_(dofs, dofs)] += root @ root.T + 10.0 * np.eye(24)
    expected = np.linalg.solve(whole[np.ix_(pattern.free, pattern.free)], load)
    assert np.allclose(tangent.free.solve(load), expected, rtol=1e-9, atol=1e-12)


@given(
    st.integers(1, 40).flatmap(
        lambda n: st.tuples(
            arrays(np.int64, n, elements=st.integers(0, 6)), arrays(np.int64, n, elements=st.integers(0, 6))
        )
    )
)
def test_two_keys_sort_as_pairs_do(keys) -> None:
    first, then = keys
    assert np.array_equal(order_by(first, then, 7), np.lexsort((then, first)))
