"""What the measurements can tell and what they cannot, in words.

The information of the data on the free parameters, scaled to ones on its diagonal, has an eigenvalue for every
direction in which they may go together; where one is near zero, the parameters of that direction make up for each
other. Errors outside the model act the same way: a calibration that is off by a known amount, as a systematic error of
the budget has it, changes the channels along a column, of which the fit takes up the share that its parameters span.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fit.budget.systematic import CAMERA_SCALE, FORCE_GAIN, GRIPPER_TRAVEL
from estimator.fit.linearised_fit import LinearisedFit
from estimator.inference.free_parameter import FreeParameter, prior_information
from estimator.inference.prior_share import prior_shares, what_rests_on_priors

FloatArray = NDArray[np.float64]

# Eigenvalues of the scaled information: deviations are 1/√ of them wider than if the others were known.
_HARD, _HOPELESS = 0.02, 1e-4
_MEMBER = 0.3
# A deviation of ln E, of −ln(1 − 2ν) or of a shape parameter in units of its scale that says nothing.
_UNDETERMINED = {"youngs_modulus": 0.5, "poisson_ratio": 0.7}
_UNDETERMINED_SHAPE = 3.0
_INSEPARABLE = 0.98


# What each of them is taken to be off by, and how that is told.
CONFOUNDERS = (FORCE_GAIN, CAMERA_SCALE, GRIPPER_TRAVEL)
OFF, _SIZE = 0.01, "1 %"


@dataclass(frozen=True, slots=True)
class Absorption:
    """What the fit makes of a confounder.

    Attributes
    ----------
    name, size : of the confounder
    share : of its squared length, nuisances projected out, that the parameters take up
    left : length of what would remain to be seen, in standard deviations
    shifts : change of each free parameter, by name: relative for Young's modulus, absolute for others
    """

    name: str
    size: str
    share: float
    left: float
    shifts: dict[str, float]


def absorptions(problem: LinearisedFit, columns: FloatArray) -> tuple[Absorption, ...]:
    """Return what the fit makes of every confounder.

    Parameters
    ----------
    problem : at the optimum
    columns : (r, k) change by each of ``CONFOUNDERS``, whitened like its residual
    """
    (J,) = problem.jacobian
    information = J.T @ J + prior_information(problem.free_parameters)
    shifts = np.linalg.solve(information, J.T @ columns)
    found = []
    for n, confounder in enumerate(CONFOUNDERS):
        squared = float(columns[:, n] @ columns[:, n])
        taken = float(shifts[:, n] @ information @ shifts[:, n])
        share = taken / squared if squared > 0 else 0.0
        by_name = {
            p.name: float(p.slope * z) / (p.value if p.unit else 1.0)
            for p, z in zip(problem.free_parameters, shifts[:, n], strict=True)
        }
        left = float(np.sqrt(max(squared - taken, 0.0)))
        found.append(Absorption(confounder.words, _SIZE, share, left, by_name))
    return tuple(found)


def identifiability(
    parameters: Sequence[FreeParameter],
    data: FloatArray,
    priors: FloatArray,
    absorbed: Sequence[Absorption],
) -> tuple[str, ...]:
    """Return sentences on what the measurements do not tell; empty where they tell everything.

    Parameters
    ----------
    parameters : that are free
    data, priors : (p, p) information of the internal variables, from the measurements and from priors
    absorbed : what the fit makes of errors outside the model
    """
    return (
        *_weak_directions(parameters, data),
        *_undetermined(parameters, data + priors),
        *what_rests_on_priors(parameters, prior_shares(data, priors).tolist()),
        *_confounded(parameters, absorbed),
    )


def _weak_directions(parameters: Sequence[FreeParameter], data: FloatArray) -> list[str]:
    scale = np.sqrt(np.diag(data))
    if len(parameters) < 2 or not np.all(scale > 0):
        return []
    found = []
    strengths, directions = np.linalg.eigh(data / np.outer(scale, scale))
    for strength, direction in zip(strengths, directions.T, strict=True):
        if strength > _HARD:
            break
        weights = zip(parameters, np.abs(direction), strict=True)
        names = _listed([parameter.label for parameter, weight in weights if weight > _MEMBER])
        verb = "cannot be told apart" if strength < _HOPELESS else "are hard to tell apart"
        wider = 1 / np.sqrt(max(strength, np.finfo(float).tiny))
        found.append(
            f"{names} {verb} by these measurements: each is known {wider:.2g} times less well than it would be "
            "with the others given."
        )
    return found


def _undetermined(parameters: Sequence[FreeParameter], information: FloatArray) -> list[str]:
    deviations = np.sqrt(np.diag(np.linalg.inv(information)))
    return [
        f"The measurements hardly determine {p.label}: its interval is as wide as what it could be."
        for p, deviation in zip(parameters, deviations, strict=True)
        if deviation > _UNDETERMINED.get(p.name, _UNDETERMINED_SHAPE)
    ]


def _confounded(parameters: Sequence[FreeParameter], absorbed: Sequence[Absorption]) -> list[str]:
    label = {p.name: p.label for p in parameters}
    found = []
    for one in absorbed:
        if one.share > _INSEPARABLE:
            largest = max(abs(value) for value in one.shifts.values())
            moved = {name: value for name, value in one.shifts.items() if abs(value) > 0.1 * largest}
            found.append(
                f"{one.name[0].upper()}{one.name[1:]} and {_listed([label[name] for name in moved])} cannot be told "
                f"apart: {one.size} too much of it moves "
                f"{_listed([f'{label[name]} by {_shift(name, value)}' for name, value in moved.items()])} and leaves "
                "no trace in the residuals."
            )
    return found


def _shift(name: str, value: float) -> str:
    return f"{100 * value:+.2g} %" if name == "youngs_modulus" else f"{value:+.2g}"


def _listed(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
