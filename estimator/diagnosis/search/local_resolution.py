"""A cause that ends within elements, refitted on a mesh that follows it.

It was found on elements as wide as itself, where a region seems too small and its contrast too strong.
"""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from estimator.diagnosis.fitting.case import Case
from estimator.diagnosis.fitting.parallel import solved_by
from estimator.diagnosis.fitting.refit import refit
from estimator.diagnosis.noise.refinement import grading_of
from estimator.diagnosis.search.candidate import Candidate, candidate_of
from estimator.diagnosis.search.context import Context
from estimator.errors import SolverError
from estimator.forward.meshing import mesh_experiment


def resolved(context: Context, winner: Candidate) -> tuple[Case, Candidate]:
    """Return the winner refitted on a mesh that follows it, and the case with that mesh.

    Both meshes leave the same of the baseline. The deviations include what this one may leave of the cause. One that
    does not end within elements stays as it is, as does one that has no equilibrium there.

    Parameters
    ----------
    context : in which the winner was refitted
    winner : at its best parameters
    """
    found = context.case, winner
    if any(effect.within_elements for effect in winner.fit.hypothesis.effects):
        with suppress(SolverError):
            found = _on_finer_mesh(context, winner)
    return found


def _on_finer_mesh(context: Context, winner: Candidate) -> tuple[Case, Candidate]:
    case, hypothesis, settings = context.case, winner.fit.hypothesis, context.settings.search
    solve = solved_by(context.executor)
    grading = replace(grading_of(case.experiments[0]), largest_m=settings.resolving_m)
    finer = replace(case, problem=mesh_experiment(case.experiments[0], grading))
    plain = solve(finer, context.baseline.hypothesis, None)
    changes = zip(case.corrections, context.baseline.predicted, plain.predicted, strict=True)
    finer = replace(finer, corrections=tuple(known + (one - two) for known, one, two in changes))
    fit = refit(finer, hypothesis, evaluations=settings.resolving_points, solve=solve)
    found = candidate_of(replace(context, case=finer), fit)
    # Of what changed from elements of 15 mm an error that falls with their edge leaves 0.76, one with its square 0.23.
    changed = [c.internal - c.of(hypothesis).internal for c in fit.free_parameters]
    return finer, replace(
        found, deviations=np.hypot(found.deviations, settings.resolving_left * np.array(changed))
    )
