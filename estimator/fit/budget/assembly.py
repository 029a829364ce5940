"""All sources of uncertainty of a finished fit, from those that it knows of to those that it does not."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError, SolverError
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fit.budget.changes import Changes, changes_of_mechanics, changes_of_rows
from estimator.fit.budget.components import (
    Component,
    bias_component,
    misfit_component,
    noise_components,
    nuisance_components,
    prior_components,
    systematic_component,
)
from estimator.fit.budget.gains import FittedCase, response_of
from estimator.fit.budget.systematic import SYSTEMATIC, Stated, Systematic
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Body:
    """What the fit solved: the retraction of a body, and its material."""

    problem: RetractionProblem
    material: Material


def all_components(
    case: FittedCase, body: Body, bias: FloatArray, stated: Stated, tell: Callable[[int, int], None]
) -> tuple[list[Component], list[str]]:
    """Return every component of a budget.

    Parameters
    ----------
    bias : (p,) that the correction for the mesh leaves, internal variables
    stated : sizes and origins
    tell : called with how many states of a body of another geometry are solved, and how many there are

    Returns
    -------
    components
    left_out : in words, the errors of the geometry with which the motion has no equilibrium

    Raises
    ------
    InputError
        A size is stated of what the fit estimates.
    """
    response = response_of(case)
    measured = [*noise_components(case, response, stated), *nuisance_components(case, response)]
    known = [one for one in measured if one.source.known and one.source.device != "robot"]
    found = [*measured, *prior_components(case, response)]
    if case.inflation > 1.0:
        found.append(misfit_component(known, case.inflation))
    if bias.any():
        found.append(bias_component(bias))
    floated = {one.source.name for one in measured}
    left_out = []
    for name, one in SYSTEMATIC.items():
        if name in floated:
            if name in stated.sizes:
                raise InputError(
                    f"uncertainty {name}: the fit estimates it, with a prior of its own; leave out its size, or take "
                    "it off the nuisances"
                )
            continue
        try:
            changes = _changes(case, body, one, stated.size_of(one), tell)
        except SolverError:
            left_out.append(one.words)
        else:
            found.append(systematic_component(case, response, one, stated, changes))
    return found, left_out


def _changes(
    case: FittedCase, body: Body, one: Systematic, size: float, tell: Callable[[int, int], None]
) -> Changes:
    """Return what an error of either sign changes, each as half of it in the square.

    A clock that is late shows where the gripper is under way, one that is early as well where it sets off; a grasp that
    begins beside a bead holds it, or does not. The change is that of the mean square over a symmetric distribution.
    """
    sides = [_changes_by(case, body, one, sign * size, tell) for sign in (1.0, -1.0)]
    return {state: np.hstack([side[state] for side in sides]) / np.sqrt(2.0) for state in sides[0]}


def _changes_by(
    case: FittedCase, body: Body, one: Systematic, size: float, tell: Callable[[int, int], None]
) -> Changes:
    if not one.mechanical:
        return changes_of_rows(one, size, case.experiments, case.schedules, case.predictions)
    solved = (body.problem, body.material, case.predictions)
    return changes_of_mechanics(one, size, case.experiments, solved, tell)
