"""E and ν on a given mesh, as it is: what the discretisation does to them is what some studies look at."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from estimator.experiment import Experiment
from estimator.fem.problem import RetractionProblem
from estimator.fit.estimate import fit_few_states
from estimator.fit.gauss_newton import minimise, moved
from estimator.fit.linearisation import Linearisation
from estimator.fit.residuals import state_means
from estimator.fit.settings import FitSettings, Objective
from estimator.fit.sqp import minimise_by_sqp
from estimator.forward.model import ForwardModel

_SEARCHES = {"likelihood": minimise, "paper": minimise_by_sqp}
_LINEAR_STEP = 0.01
# No tissue widens where it is drawn; a search that looks there may find no equilibrium.
_POISSON_RATIOS = (0.0, 0.4999)


@dataclass(frozen=True, slots=True)
class Fitted:
    """E in Pa, ν, the states that were solved for them, and the wall time in s."""

    youngs_modulus: float
    poisson_ratio: float
    solves: int
    seconds: float


def fitted(
    problem: RetractionProblem, experiments: Sequence[Experiment], objective: Objective = "likelihood"
) -> Fitted:
    """Fit E and ν to all states, from a fit to a few of them.

    Raises
    ------
    FitError
        The data do not determine the parameters, or the fit does not converge.
    SolverError
        The motion has no equilibrium at the first guess.
    """
    started = time.perf_counter()
    settings = FitSettings(objective=objective, bounds={"poisson_ratio": _POISSON_RATIOS})
    model = ForwardModel(problem, experiments)
    means = state_means(experiments, model.schedules)
    rough = fit_few_states(model, means, _silent, settings)
    states = [list(range(len(schedule.poses))) for schedule in model.schedules]
    every = Linearisation(model, means, states, settings, "all states", _silent)
    search = _SEARCHES[objective]
    iterates, last = search(every.objective, settings.free, rough[-1].values, _LINEAR_STEP)
    found = moved(settings.free, iterates[-1].values, last.step)
    return Fitted(
        found["youngs_modulus"],
        found["poisson_ratio"],
        model.solved_states,
        time.perf_counter() - started,
    )


def _silent(stage: str, done: int, total: int) -> None:
    pass
