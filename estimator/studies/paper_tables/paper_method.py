"""The paper's estimator: its objective, its scale factor and sequential quadratic programming, on a given mesh.

Eq. (1): J(E, ν) = Σ ‖x_s − x_o‖² + C Σ ‖f_s − f_o‖² over rows, fiducials x and forces f. Eq. (3): C is the range of the
first sum over the region of interest over that of the second; its greatest value is found by sampling the region, its
least by a minimisation of its own. The paper minimises by MATLAB's ``fmincon``, SQP with a quasi-Newton approximation
and finite differences; here it is SciPy's SLSQP with finite differences. It gives neither its region of interest nor
where it begins; both are stated here.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, minimize

from estimator.errors import FitError
from estimator.experiment import Experiment
from estimator.studies.paper_tables.response import UnitResponse
from estimator.studies.running.case import Row

FloatArray = NDArray[np.float64]

# The region of interest, and the first guess; neither is given in the paper.
MODULUS_PA, POISSON_RATIO = (1e3, 60e3), (0.05, 0.495)
_START = (10e3, 0.40)
_SAMPLED = (3, 5)
# Of finite differences, along the scaled variables.
_DIFFERENCE = 1e-6
_TOLERANCE = 1e-10


@dataclass(frozen=True)
class PaperEstimate:
    """What the paper's method found, with the figures that the paper gives of it.

    The model's solutions count as prescaling: they are made once, and the minimisation interpolates between them.
    """

    youngs_modulus: float
    poisson_ratio: float
    rmse_fiducials_m: float
    rmse_force_n: float
    iterations: int
    calls: int
    prescaling_s: float
    minimisation_s: float

    def row(self, **further: float | str) -> Row:
        """Return it as the row of a table."""
        return {
            "youngs_modulus": self.youngs_modulus,
            "poisson_ratio": self.poisson_ratio,
            "seconds": self.prescaling_s + self.minimisation_s,
            "prescaling_seconds": self.prescaling_s,
            "iterations": self.iterations,
            "calls": self.calls,
            "rmse_fiducials": self.rmse_fiducials_m,
            "rmse_force": self.rmse_force_n,
            **further,
        }


class _Misfits:
    """The two sums of eq. (1) for any material, over several retractions."""

    def __init__(self, responses: Sequence[UnitResponse], experiments: Sequence[Experiment]) -> None:
        self._responses = responses
        self._seen = [
            (
                (one.fiducials[1:] - one.fiducials[0]).reshape(-1),
                (one.wrench[1:, :3] - one.wrench[0, :3]).reshape(-1),
            )
            for one in experiments
        ]

    def off(self, modulus: float, ratio: float) -> tuple[FloatArray, FloatArray]:
        """Return predicted minus measured fiducials (k, 3), m, and forces (n, 3), N."""
        pairs = [
            (response.at(ratio), seen) for response, seen in zip(self._responses, self._seen, strict=True)
        ]
        return (
            np.concatenate([(moved - seen[0]).reshape(-1, 3) for (moved, _), seen in pairs]),
            np.concatenate([(modulus * force - seen[1]).reshape(-1, 3) for (_, force), seen in pairs]),
        )

    def sums(self, modulus: float, ratio: float) -> tuple[float, float]:
        """Return Σ ‖x_s − x_o‖², m², and Σ ‖f_s − f_o‖², N²."""
        fiducials, forces = self.off(modulus, ratio)
        return float(np.sum(fiducials**2)), float(np.sum(forces**2))


def estimate_by_paper(responses: Sequence[UnitResponse], experiments: Sequence[Experiment]) -> PaperEstimate:
    """Estimate E and ν as the paper does.

    Parameters
    ----------
    responses : of the model, one for each experiment
    experiments : what was measured, first of all at rest

    Raises
    ------
    FitError
        The minimisation has not converged.
    """
    began = time.perf_counter()
    misfits = _Misfits(responses, experiments)
    scale = _scale_factor(misfits)
    prescaled = time.perf_counter()

    def objective(modulus: float, ratio: float) -> float:
        in_motion, in_force = misfits.sums(modulus, ratio)
        return in_motion + scale * in_force

    found, calls = _minimised(objective)
    modulus, ratio = _material(found.x)
    fiducials, forces = misfits.off(modulus, ratio)
    return PaperEstimate(
        modulus,
        ratio,
        _rmse(fiducials),
        _rmse(forces),
        int(found.nit),
        calls,
        prescaled - began + sum(response.seconds for response in responses),
        time.perf_counter() - prescaled,
    )


def _scale_factor(misfits: _Misfits) -> float:
    """Return C of eq. (3), m²/N²."""
    moduli = np.geomspace(*MODULUS_PA, _SAMPLED[0])
    ratios = np.linspace(*POISSON_RATIO, _SAMPLED[1])
    sampled = np.array([misfits.sums(modulus, ratio) for modulus in moduli for ratio in ratios])
    in_motion, _ = _minimised(lambda modulus, ratio: misfits.sums(modulus, ratio)[0])
    in_force, _ = _minimised(lambda modulus, ratio: misfits.sums(modulus, ratio)[1])
    spread = sampled.max(axis=0) - [in_motion.fun, in_force.fun]
    return float(spread[0] / spread[1])


def _minimised(objective: Callable[[float, float], float]) -> tuple[OptimizeResult, int]:
    """Return SciPy's result in scaled variables, its function in its own unit, and how often that was called."""
    calls = 0
    unit = max(objective(*_START), np.finfo(float).tiny)

    def scaled(at: FloatArray) -> float:
        nonlocal calls
        calls += 1
        return objective(*_material(at)) / unit

    ends = np.array([_scaled(MODULUS_PA[n], POISSON_RATIO[n]) for n in (0, 1)])
    found = minimize(
        scaled,
        _scaled(*_START),
        method="SLSQP",
        bounds=list(zip(*ends, strict=True)),
        options={"ftol": _TOLERANCE, "eps": _DIFFERENCE, "maxiter": 100},
    )
    # A search that ends on the plateau of a flat sum cannot go on: what it found stands.
    if not found.success and found.status not in (8, 9):
        raise FitError(f"sequential quadratic programming has not converged ({found.message})")
    found.fun *= unit
    return found, calls


def _scaled(modulus: float, ratio: float) -> FloatArray:
    """Return both variables as shares of the region of interest."""
    return np.array(
        [
            (modulus - MODULUS_PA[0]) / (MODULUS_PA[1] - MODULUS_PA[0]),
            (ratio - POISSON_RATIO[0]) / (POISSON_RATIO[1] - POISSON_RATIO[0]),
        ]
    )


def _material(at: FloatArray) -> tuple[float, float]:
    inside = np.clip(at, 0.0, 1.0)
    modulus = MODULUS_PA[0] + inside[0] * (MODULUS_PA[1] - MODULUS_PA[0])
    return float(modulus), float(POISSON_RATIO[0] + inside[1] * (POISSON_RATIO[1] - POISSON_RATIO[0]))


def _rmse(off: FloatArray) -> float:
    """Return the root mean square of the lengths of vectors (n, 3)."""
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
