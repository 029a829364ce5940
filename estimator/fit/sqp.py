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


def minimise_by_sqp(
    linearise: Callable[[Values], WhitenedSystem],
    parameters: tuple[FitParameter, ...],
    start: Values,
    tolerance: float,
    iterations: int = 40,
) -> tuple[list[Iterate], MarginalStep]:
    """Lower the sum of squares of the residuals until the linearised problem promises no step beyond ``tolerance``.

    Parameters, results and errors are those of :func:`~estimator.fit.gauss_newton.minimise`. The quadratic programmes
    begin with the identity for the second derivatives, so that each variable is scaled by the root of its own there.
    """
    first = marginal_step(linearise(start), parameters, start)
    iterates, at = [Iterate(dict(start), first.chi2)], start
    scale = np.sqrt(np.diag(first.information))
    # A parameter that is off by a tenth of the tolerance raises half the sum by this much.
    worthwhile = 0.5 * float(0.1 * tolerance * scale.min()) ** 2

    def values_of(scaled: FloatArray) -> Values:
        pairs = zip(parameters, scaled / scale, strict=True)
        found = {p.name: min(max(p.from_internal(float(x)), p.lower), p.upper) for p, x in pairs}
        return {**start, **found}

    def objective(scaled: FloatArray) -> float:
        residual = linearise(values_of(scaled)).residual
        return 0.5 * float(residual @ residual)

    def gradient(scaled: FloatArray) -> FloatArray:
        system = linearise(values_of(scaled))
        return -(system.by_parameter.T @ system.residual) / scale

    def note(xk: FloatArray) -> None:
        nonlocal at
        at = values_of(xk)
        system = linearise(at)
        iterates.append(Iterate(at, float(system.residual @ system.residual)))

    try:
        found = minimize(
            objective,
            scale * [p.to_internal(start[p.name]) for p in parameters],
            jac=gradient,
            method="SLSQP",
            bounds=[
                (s * p.to_internal(p.lower), s * p.to_internal(p.upper))
                for p, s in zip(parameters, scale, strict=True)
            ],
            callback=note,
            options={"maxiter": iterations, "ftol": worthwhile},
        )
    except SolverError as failure:
        raise FitError(f"sequential quadratic programming left what can be solved: {failure}") from failure
    if not found.success:
        raise FitError(
            f"sequential quadratic programming has not converged ({found.message}) after {found.nit} iterations"
        )
    at = values_of(found.x)
    return [*iterates, Iterate(at, 2 * float(found.fun))], marginal_step(linearise(at), parameters, at)
