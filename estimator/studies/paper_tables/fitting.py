"""E and ν on a given mesh, mostly as it is: what the discretisation does to them is what some studies look at."""

import math
from collections.abc import Sequence
from dataclasses import replace

from estimator.errors import FitError
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fit.estimate import estimate
from estimator.fit.nuisances import DISCRETISATION, USUAL
from estimator.fit.result import Estimate
from estimator.fit.settings import FitSettings, Objective
from estimator.studies.running.case import Row

# No tissue widens where it is drawn; a search that looks there may find no equilibrium.
_POISSON_RATIOS = (0.0, 0.4999)


def fitted(
    problem: RetractionProblem,
    experiments: Sequence[Experiment],
    objective: Objective = "likelihood",
    finer: RetractionProblem | None = None,
) -> Estimate:
    """Fit E and ν to all states, from a fit to a few of them.

    Parameters
    ----------
    problem : on the model's mesh
    finer : on a mesh that the discretisation error is measured on and corrected for; it is let be without one

    Raises
    ------
    FitError
        The data do not determine the parameters, or the fit does not converge.
    SolverError
        The motion has no equilibrium at the first guess.
    """
    # What the data alone say is compared with the truth: no prior.
    settings = FitSettings(
        objective=objective, priors={"poisson_ratio": None}, bounds={"poisson_ratio": _POISSON_RATIOS}
    )
    try:
        if finer is None:
            as_it_is = replace(settings, nuisances=USUAL - {DISCRETISATION})
            return estimate(experiments, settings=as_it_is, mesh=lambda _: problem)
        return estimate(experiments, settings=settings, mesh=lambda _: problem, finer_mesh=lambda _: finer)
    except OverflowError as error:
        # Data far from any of the model's can send a step, or the end of an interval, beyond all numbers.
        raise FitError(
            f"the fit left the range of numbers ({error}); the data are far from the model's"
        ) from error


def row_of(found: Estimate, **further: float | str) -> Row:
    """Return what a table keeps of an estimate, and what else the case has to say.

    E in Pa with its interval, ν with its own, wall time in s, root mean square lengths of what is left of the
    fiducials' positions, m, and of the forces, N. A call is the solution of all states.
    """
    states = sum(len(fit.displacements) for fit in found.fits)
    low, high = found.youngs_modulus.interval95
    least, largest = found.poisson_ratio.interval95
    return {
        "youngs_modulus": found.youngs_modulus.value,
        "youngs_modulus_low": low,
        "youngs_modulus_high": high,
        "poisson_ratio": found.poisson_ratio.value,
        "poisson_ratio_low": least,
        "poisson_ratio_high": largest,
        "seconds": found.seconds,
        "iterations": len(found.iterates) - 1,
        "calls": math.ceil(found.forward_solves / states),
        "rmse_fiducials": math.sqrt(3) * found.rmse.fiducials,
        "rmse_force": math.sqrt(3) * found.rmse.force,
        **further,
    }
