"""Fits one law to stress and strain of a uniaxial test; standard errors expect correlated residuals.

What is left of a stress-strain curve after a fit is the smooth misfit of the law, not white noise: the
textbook covariance of n "independent" rows would shrink with the machine's sampling rate. The errors here
come from a jackknife that leaves out one of five contiguous blocks of strain at a time (H. R. Künsch, Ann.
Statist. 17 (1989) 1217). Where residuals are correlated over 5, 10 or 25 % of the fitted range it yields
1.0, 0.8 or 0.6 of the true scatter of E; the textbook formula 0.16, 0.11 or 0.07 at 400 rows. Neither knows
of the load cell's calibration, of other specimens, or of a test that is less homogeneous than assumed.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import stdtrit

from estimator.errors import FitError, SolverError
from estimator.materials import NeoHookean
from estimator.materials.law import Law
from estimator.uniaxial.stress import uniaxial_stress

FloatArray = NDArray[np.float64]

BLOCKS = 5
FEWEST_ROWS = 2 * BLOCKS
_BOUND_MARGIN = 1e-6  # of a parameter's scale


@dataclass(frozen=True, slots=True)
class Estimate:
    """A fitted parameter with its jackknife standard error; ``at_bound`` where the fit stopped at a bound."""

    name: str
    value: float
    std: float
    at_bound: bool

    @property
    def interval95(self) -> tuple[float, float]:
        """Student's 95 % interval for as many degrees of freedom as the jackknife leaves."""
        half_width = float(stdtrit(BLOCKS - 1, 0.975)) * self.std
        return self.value - half_width, self.value + half_width


@dataclass(frozen=True, slots=True)
class LawFit:
    """A law with fitted parameters.

    Attributes
    ----------
    law : the law
    youngs_modulus : of small strain, Pa
    shape : the law's shape parameters
    slack : strain of the crosshead before the specimen took load (negative: it was loaded before); None where
        it was not freed
    """

    law: Law
    youngs_modulus: Estimate
    shape: tuple[Estimate, ...]
    slack: Estimate | None

    @property
    def parameters(self) -> tuple[Estimate, ...]:
        """All fitted parameters."""
        return (self.youngs_modulus, *self.shape, *(() if self.slack is None else (self.slack,)))

    def stress(self, strain: FloatArray) -> FloatArray:
        """Return the nominal stress, Pa, at engineering strains.

        Raises
        ------
        SolverError
            A strain lies beyond the law's limit.
        """
        return _stress(self.law, np.array([parameter.value for parameter in self.parameters]), strain)

    def rms_error(self, strain: FloatArray, stress: FloatArray) -> float:
        """Return the root mean square error, Pa; infinite where the law admits no such strain."""
        try:
            return float(np.sqrt(np.mean((self.stress(strain) - stress) ** 2)))
        except SolverError:
            return float("inf")


def specimen_stretch(strain: FloatArray, slack: float) -> FloatArray:
    """Return the specimen's stretch at strains of the crosshead: 1 until the slack is used up."""
    return np.asarray(1 + np.sign(strain) * np.maximum(np.abs(strain) - slack, 0.0))


def fit_law(law: Law, strain: FloatArray, stress: FloatArray, slack_limit: float = 0.0) -> LawFit:
    """Fit E and the shape parameters, and the slack within ± ``slack_limit`` unless that is 0.

    Parameters
    ----------
    strain, stress : (n,) engineering strain, nominal stress in Pa; n ≥ ``FEWEST_ROWS``

    Raises
    ------
    FitError
        The search did not converge, or stress does not rise over these strains.
    """
    problem = _problem(law, strain, stress, slack_limit)
    every = np.arange(len(strain))
    values = min((problem.solve(start, every) for start in problem.starts()), key=problem.cost)
    replicates = np.array(
        [problem.solve(values, np.setdiff1d(every, block)) for block in np.array_split(every, BLOCKS)]
    )
    spread = np.sqrt((BLOCKS - 1) * np.var(replicates, axis=0))
    nearest = np.where(values - problem.lower < problem.upper - values, problem.lower, problem.upper)
    at_bound = np.abs(values - nearest) <= _BOUND_MARGIN * problem.scale
    values = np.where(at_bound, nearest, values)
    modulus, *others = (
        Estimate(name, float(value), float(std), bool(bound))
        for name, value, std, bound in zip(problem.names, values, spread, at_bound, strict=True)
    )
    count = len(law.shape_parameters)
    return LawFit(law, modulus, tuple(others[:count]), others[count] if slack_limit > 0 else None)


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """Bounded least squares; the unknowns are E, the shape parameters, and the slack if it is free."""

    law: Law
    strain: FloatArray
    stress: FloatArray
    names: tuple[str, ...]
    null: FloatArray
    lower: FloatArray
    upper: FloatArray
    scale: FloatArray

    def starts(self) -> list[FloatArray]:
        """Return the null and points off it, since the cost may have several minima in the shape."""
        offsets = self.scale * np.where(np.arange(len(self.scale)) > 0, 1.0, 0.0)
        return [np.clip(self.null + k * offsets, self.lower, self.upper) for k in (0, 1, 5)]

    def cost(self, values: FloatArray) -> float:
        return float(np.sum((_stress(self.law, values, self.strain) - self.stress) ** 2))

    def solve(self, start: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
        strain, stress = self.strain[rows], self.stress[rows]
        size = np.linalg.norm(stress)

        def misfit(values: FloatArray) -> FloatArray:
            return (_stress(self.law, values, strain) - stress) / size

        found = least_squares(
            misfit,
            start,
            jac="3-point",
            bounds=(self.lower, self.upper),
            x_scale=self.scale,
            ftol=1e-12,
            xtol=1e-10,
            gtol=1e-12,
        )
        if not found.success:
            raise FitError(
                f"the {self.law.name} law does not converge on this record; narrow its range of strain"
            )
        return np.asarray(found.x)


def _problem(law: Law, strain: FloatArray, stress: FloatArray, slack_limit: float) -> _Problem:
    unit = uniaxial_stress(NeoHookean(), 1.0, np.empty(0), specimen_stretch(strain, 0.0))
    modulus = float(unit @ stress / (unit @ unit))
    if not modulus > 0:
        raise FitError(
            "stress does not rise with strain over the fitted range, as if the specimen bore no load; "
            "check which columns hold load and travel, or fit from a larger strain"
        )
    shape = law.shape_parameters
    upper = _admitted(law, specimen_stretch(strain, -slack_limit))
    unknowns = [
        ("youngs_modulus", modulus, 1e-3 * modulus, 1e3 * modulus, modulus),
        *((p.name, p.null, p.lower, top, p.scale) for p, top in zip(shape, upper, strict=True)),
    ]
    if slack_limit > 0:
        unknowns.append(("slack", 0.0, -slack_limit, slack_limit, 0.1 * slack_limit))
    names, *columns = zip(*unknowns, strict=True)
    null, lower, top, scale = np.array(columns)
    return _Problem(law, strain, stress, names, null, lower, top, scale)


def _stress(law: Law, values: FloatArray, strain: FloatArray) -> FloatArray:
    count = len(law.shape_parameters)
    slack = float(values[1 + count]) if len(values) > 1 + count else 0.0
    return uniaxial_stress(law, float(values[0]), values[1 : 1 + count], specimen_stretch(strain, slack))


def _admitted(law: Law, stretch: FloatArray) -> list[float]:
    """Return the largest value of each shape parameter at which the law still admits every stretch."""
    null = np.array([parameter.null for parameter in law.shape_parameters])

    def admits(n: int, value: float) -> bool:
        shape = null.copy()
        shape[n] = value
        try:
            uniaxial_stress(law, 1.0, shape, stretch)
        except SolverError:
            return False
        return True

    def largest(n: int) -> float:
        inside, outside = null[n], law.shape_parameters[n].upper
        if admits(n, outside):
            return outside
        while outside - inside > 1e-4 * outside:
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if admits(n, middle) else (inside, middle)
        return float(inside)

    return [largest(n) for n in range(len(null))]
