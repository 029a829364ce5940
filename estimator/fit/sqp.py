"""Sequential quadratic programming on a sum of squares, with exact gradients: the optimiser of the paper.

D. Kraft, "A software package for sequential quadratic programming", DFVLR-FB 88-28 (1988), as SciPy has it.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from estimator.errors import FitError, SolverError
from estimator.fit.gauss_newton import Iterate, MarginalStep, Values, marginal_step
from estimator.fit.parameters import FitParameter
from estimator.fit.residuals import WhitenedSystem

FloatArray = NDArray[np.float64]

# No first step changes an internal variable by more than this.
_FIRST_STEP = 0.3


def minimise_by_sqp(
    linearise: Callable[[Values], WhitenedSystem],
    parameters: tuple[FitParameter, ...],
    start: Values,
    tolerance: float,
    iterations: int = 40,
) -> tuple[list[Iterate], MarginalStep]:
    """Lower the sum of squares of the residuals until the linearised problem promises no step beyond ``tolerance``.

    Parameters, results and errors are those of :func:`~estimator.fit.gauss_newton.minimise`. The sum is scaled so that
    its first steepest-descent step, which begins the quadratic programmes, has a sensible length.
    """
    first = marginal_step(linearise(start), parameters, start)
    iterates, at = [Iterate(dict(start), first.chi2)], start
    # A parameter that is off by a tenth of the tolerance raises the sum by this much.
    worthwhile = (0.1 * tolerance) ** 2 * float(np.diag(first.information).min())
    scale = _FIRST_STEP / max(float(np.linalg.norm(2 * first.gradient)), np.finfo(float).tiny)

    def values_of(internal: FloatArray) -> Values:
        pairs = zip(parameters, internal, strict=True)
        found = {p.name: min(max(p.from_internal(float(x)), p.lower), p.upper) for p, x in pairs}
        return {**start, **found}

    def objective(internal: FloatArray) -> float:
        residual = linearise(values_of(internal)).residual
        return scale * float(residual @ residual)

    def gradient(internal: FloatArray) -> FloatArray:
        system = linearise(values_of(internal))
        return -2 * scale * (system.by_parameter.T @ system.residual)

    def note(xk: FloatArray) -> None:
        nonlocal at
        at = values_of(xk)
        system = linearise(at)
        iterates.append(Iterate(at, float(system.residual @ system.residual)))

    try:
        found = minimize(
            objective,
            np.array([p.to_internal(start[p.name]) for p in parameters]),
            jac=gradient,
            method="SLSQP",
            bounds=[(p.to_internal(p.lower), p.to_internal(p.upper)) for p in parameters],
            callback=note,
            options={"maxiter": iterations, "ftol": scale * worthwhile},
        )
    except SolverError as failure:
        raise FitError(f"sequential quadratic programming left what can be solved: {failure}") from failure
    if not found.success:
        raise FitError(
            f"sequential quadratic programming has not converged ({found.message}) after {found.nit} iterations"
        )
    at = values_of(found.x)
    return [*iterates, Iterate(at, float(found.fun) / scale)], marginal_step(linearise(at), parameters, at)
