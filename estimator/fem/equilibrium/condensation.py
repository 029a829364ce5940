"""Held nodes set free at a solved state: the tissue condensed onto them, so that the factor at hand serves.

With R the degrees of freedom that are set free and f those that were free before, a small motion of R at equilibrium
moves f by −K_ff⁻¹ K_fR and asks for the forces S = K_RR − K_Rf K_ff⁻¹ K_fR on R (the Schur complement; Guyan 1965).
Whatever subset of R is freed, and whatever springs hold it, is then a small dense system.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array

from estimator.fem.assembly.body import stiffness
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.grip import wrench_by_forces
from estimator.fem.equilibrium.observation import interpolate
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.fem.terms.term import Term, summed_stiffness

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Condensed:
    """The tissue of a solved state as r degrees of freedom feel it, which the state holds.

    Attributes
    ----------
    stiffness : (r, r) N/m
    follows : (nf, r) how the free degrees of freedom move with a unit motion of each; by reciprocity, what a unit load
        on one of those loads them with
    wrench, fiducials : (6, r) and (m, 3, r) what the sensors see of a unit motion of each
    """

    stiffness: FloatArray
    follows: FloatArray
    wrench: FloatArray
    fiducials: FloatArray


def condensed_onto(
    problem: RetractionProblem, state: EquilibriumState, terms: tuple[Term, ...], dofs: IntArray
) -> Condensed:
    """Condense the tissue onto degrees of freedom ``dofs`` (r,) that the problem holds.

    ``terms`` act on the tissue at this state.
    """
    free, gripped = problem.pattern.free, problem.pattern.gripped
    blocks = _columns(problem, state, terms, dofs)
    coupling = blocks[free]
    follows = -state.tangent.free.solve(coupling.toarray())
    motion = np.zeros((problem.body.mesh.points.size, len(dofs)))
    motion[free], motion[dofs] = follows, np.eye(len(dofs))
    held = state.tangent.gripped_free @ follows + blocks[gripped].toarray()
    return Condensed(
        blocks[dofs].toarray() + coupling.T @ follows,
        follows,
        wrench_by_forces(problem, state, held, motion),
        interpolate(problem, motion),
    )


def _columns(
    problem: RetractionProblem, state: EquilibriumState, terms: tuple[Term, ...], dofs: IntArray
) -> csc_array:
    """Return the columns (3n, r) of the stiffness of all nodes."""
    cells, size = problem.body.mesh.cells, problem.body.mesh.points.size
    number = np.full(size, -1)
    number[dofs] = np.arange(len(dofs))
    of_terms, response = summed_stiffness(terms, state.displacement, state.response), state.response
    lower = stiffness(problem.body, state.material, response, response.pressure, of_terms.energy)
    if of_terms.elements is not None:
        lower += of_terms.elements
    nodes = np.zeros((size // 3, 3, 3)) if of_terms.nodes is None else of_terms.nodes
    of_cells = (3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), -1)
    touched = (number[of_cells] >= 0).any(axis=1)
    of_cells, below = of_cells[touched], np.tril(lower[touched], -1)
    whole = below + below.swapaxes(1, 2) + np.eye(below.shape[1]) * lower[touched]
    row, column = np.broadcast_arrays(of_cells[:, :, None], number[of_cells][:, None, :])
    kept = column >= 0
    at = dofs.reshape(-1, 1) // 3 * 3 + np.arange(3)
    entries = np.concatenate([whole[kept], nodes[dofs // 3, :, dofs % 3].ravel()])
    rows = np.concatenate([row[kept], at.ravel()])
    columns = np.concatenate([column[kept], np.repeat(np.arange(len(dofs)), 3)])
    return csc_array(coo_array((entries, (rows, columns)), shape=(size, len(dofs))))
