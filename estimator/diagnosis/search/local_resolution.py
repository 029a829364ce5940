"""A cause that ends within elements, refitted on a mesh that follows it.

It was found on elements as wide as itself, where a region seems too small and its contrast too strong.
"""

from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from estimator.diagnosis.evidence.discrepancy import ModelError
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.fitting.gauss_newton import refit
from estimator.diagnosis.fitting.parallel import solved_by
from estimator.diagnosis.search.baseline import GRADING
from estimator.diagnosis.search.candidate import Candidate, candidate_of
from estimator.errors import SolverError
from estimator.forward.meshing import mesh_experiment

_RESOLVING = replace(GRADING, largest_m=6.5e-3)
# Of what changed from elements of 15 mm an error that falls with their edge leaves 0.76 here, one with its square 0.23.
_LEFT = 0.5
_POINTS = 4


def resolved(
    case: Case, baseline: Linearisation, error: ModelError, winner: Candidate, executor: Executor
) -> tuple[Case, Candidate]:
    """Return the winner refitted on a mesh that follows it, and the case with that mesh.

    Both meshes leave the same of the baseline. The deviations include what this one may leave of the cause. One that
    does not end within elements stays as it is, as does one that has no equilibrium there.

    Parameters
    ----------
    case, baseline, error : in which the winner was refitted
    winner : at its best parameters
    """
    hypothesis = winner.fit.hypothesis
    if not any(effect.within_elements for effect in hypothesis.effects):
        return case, winner
    solve = solved_by(executor)
    finer = replace(case, problem=mesh_experiment(case.experiments[0], _RESOLVING))
    try:
        plain = solve(finer, baseline.hypothesis, None)
        changes = zip(case.corrections, baseline.predicted, plain.predicted, strict=True)
        finer = replace(finer, corrections=tuple(known + (one - two) for known, one, two in changes))
        fit = refit(finer, hypothesis, evaluations=_POINTS, solve=solve)
    except SolverError:
        return case, winner
    found = candidate_of(finer, baseline, error, fit)
    changed = [c.get(fit.hypothesis) - c.get(hypothesis) for c in fit.free_parameters]
    return finer, replace(found, deviations=np.hypot(found.deviations, _LEFT * np.array(changed)))
