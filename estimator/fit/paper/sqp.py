"""Sequential quadratic programming on a sum of squares, with exact gradients: the optimiser of the paper.

D. Kraft, "A software package for sequential quadratic programming", DFVLR-FB 88-28 (1988), as SciPy has it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from estimator.errors import FitError, SolverError
from estimator.fit.search import Iterate, Linearise, Values, at_values, determined_step
from estimator.inference.free_parameter import FreeParameter
from estimator.inference.gauss_newton import NewtonStep
from estimator.inference.linear_model import chi2_of

FloatArray = NDArray[np.float64]


def minimise_by_sqp(
    linearise: Linearise,
    parameters: Sequence[FreeParameter],
    start: Values,
    tolerance: float,
    iterations: int = 40,
) -> tuple[list[Iterate], NewtonStep]:
    """Lower the sum of squares of the residuals until the linearised problem promises no step beyond ``tolerance``.

    Parameters, results and errors are those of :func:`~estimator.fit.search.minimise`. The quadratic programmes
    begin with the identity for the second derivatives, so that each variable is scaled by the root of its own there.
    """
    first = determined_step(linearise(start))
    iterates, at = [Iterate(dict(start), first.chi2)], start
    scale = np.sqrt(np.diag(first.information))
    # A parameter that is off by a tenth of the tolerance raises half the sum by this much.
    worthwhile = 0.5 * float(0.1 * tolerance * scale.min()) ** 2

    def values_of(scaled: FloatArray) -> Values:
        pairs = zip(parameters, scaled / scale, strict=True)
        found = {p.name: p.at(p.transform.value_of(float(x))).value for p, x in pairs}
        return {**start, **found}

    def objective(scaled: FloatArray) -> float:
        (residual,) = linearise(values_of(scaled)).residual
        return 0.5 * float(residual @ residual)

    def gradient(scaled: FloatArray) -> FloatArray:
        problem = linearise(values_of(scaled))
        return -(problem.jacobian[0].T @ problem.residual[0]) / scale

    def note(xk: FloatArray) -> None:
        nonlocal at
        at = values_of(xk)
        iterates.append(Iterate(at, chi2_of(linearise(at).residual)))

    try:
        found = minimize(
            objective,
            scale * [p.internal for p in at_values(parameters, start)],
            jac=gradient,
            method="SLSQP",
            bounds=[
                (s * p.transform.internal_of(p.lower), s * p.transform.internal_of(p.upper))
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
    return [*iterates, Iterate(at, 2 * float(found.fun))], determined_step(linearise(at))
