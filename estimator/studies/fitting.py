"""E and ν on a given mesh, as it is: what the discretisation does to them is what some studies look at."""

from collections.abc import Sequence
from dataclasses import dataclass

from estimator.experiment import Experiment
from estimator.fem.problem import RetractionProblem
from estimator.fit.estimate import estimate
from estimator.fit.nuisances import DISCRETISATION, USUAL
from estimator.fit.settings import FitSettings, Objective

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
    settings = FitSettings(
        objective=objective,
        bounds={"poisson_ratio": _POISSON_RATIOS},
        nuisances=USUAL - {DISCRETISATION},
    )
    found = estimate(experiments, settings=settings, mesh=lambda _: problem)
    return Fitted(found.youngs_modulus.value, found.poisson_ratio.value, found.forward_solves, found.seconds)
