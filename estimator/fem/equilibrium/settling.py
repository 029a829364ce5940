"""Tissue at rest as what acts on it grows to its full size: its weight, and all else that is there before a motion."""

from collections.abc import Callable

from estimator.errors import SolverError
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.fem.terms.rubbing import that_rub
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

# The share of the loads at rest from which their continuation starts, and below which it gives up.
_FIRST_SHARE = 1 / 16
_SMALLEST_SHARE = 1e-4
_GROWTH = 2.0


def settled(solver: EquilibriumSolver, material: Material, terms: tuple[Term, ...] = ()) -> EquilibriumState:
    """Return the state at rest under the tissue's weight; the unloaded one where it has none.

    Of the terms those act alone that rub on what holds the tissue.

    Raises
    ------
    SolverError
        The tissue bears no more than a part of its weight.
    """
    holding = that_rub(terms)
    unloaded = solver.rest(material, holding)
    if not solver.problem.heavy:
        return unloaded

    def under(share: float, near: EquilibriumState) -> EquilibriumState:
        partly = solver.under_weight(share)
        return partly.refine(near.pose, material, near.displacement, near.response.pressure, holding)

    return grown(unloaded, under)


def grown(
    unloaded: EquilibriumState, under: Callable[[float, EquilibriumState], EquilibriumState]
) -> EquilibriumState:
    """Follow the tissue at rest while what acts on it grows from nothing to its full size.

    Parameters
    ----------
    under : returns the state under a share of it, given the state under a smaller one

    Raises
    ------
    SolverError
        There is no equilibrium under more than a part of it.
    """
    state, reached, step = unloaded, 0.0, 1.0
    while reached < 1.0:
        target = min(1.0, reached + step)
        try:
            state = under(target, state)
        except SolverError as failure:
            step = _FIRST_SHARE if step > _FIRST_SHARE else step / 2
            if step < _SMALLEST_SHARE:
                raise SolverError(
                    f"at rest, no equilibrium under more than {100 * reached:.0f} % of what acts on the tissue: "
                    f"{failure}"
                ) from failure
        else:
            reached, step = target, _GROWTH * step
    return state
