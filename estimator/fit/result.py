"""What an estimation returns."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.discretisation.mesh import Mesh
from estimator.fit.budget.budget import Budget
from estimator.fit.identifiability import Absorption
from estimator.fit.profile import Profile
from estimator.fit.search import Iterate
from estimator.inference.free_parameter import FreeParameter
from estimator.inference.normal import Z95

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ParameterEstimate:
    """A value with its standard deviation and its 95 % interval, which need not be symmetric; no width if fixed."""

    value: float
    std: float
    interval95: tuple[float, float]


def interval(parameter: FreeParameter, internal_std: float) -> ParameterEstimate:
    """Return the estimate whose interval is symmetric in the internal variable, cut at the bounds."""
    low, high = (parameter.after(sign * Z95 * internal_std).value for sign in (-1.0, 1.0))
    return ParameterEstimate(parameter.value, internal_std * parameter.slope, (low, high))


@dataclass(frozen=True, slots=True)
class Floated:
    """What the nuisances took up.

    Attributes
    ----------
    tares : for each experiment the wrench (6,) that the sensor shows unloaded, N and N·m; zeros where none floats
    rest_offsets : (m, 3) measured less stated rest positions of the fiducials, m
    force_gain : of the force sensor, less one
    discretisation : change of each free parameter by the correction of the discretisation error, its own unit
    least_weight : smallest weight that the loss left to a channel of a row, and the share of them below a half
    """

    tares: tuple[FloatArray, ...]
    rest_offsets: FloatArray
    force_gain: float
    discretisation: Mapping[str, float]
    least_weight: float
    rejected_share: float


@dataclass(frozen=True, slots=True)
class Rmse:
    """Root mean square of measured minus predicted, a component: force in N, torque in N·m, fiducials in m.

    It is NaN of what was not measured.
    """

    force: float
    torque: float
    fiducials: float


@dataclass(frozen=True, eq=False)
class ExperimentFit:
    """An experiment beside its prediction.

    Attributes
    ----------
    experiment : as it was read
    wrench, fiducials : (n, 6) and (n, m, 3), predicted for each row
    displacements : (s, p, 3) nodal displacements of the distinct states, m
    state_of_row : (n,) which of them each row shows
    wrench_std, fiducials_std : like those, what noise gives the residuals: the sensors', and that of the gripper's
        reported position
    """

    experiment: Experiment
    wrench: FloatArray
    fiducials: FloatArray
    displacements: FloatArray
    state_of_row: NDArray[np.int64]
    wrench_std: FloatArray
    fiducials_std: FloatArray

    @property
    def displacement(self) -> FloatArray:
        """Nodal displacements (p, 3) where the gripper is farthest from where it began, m."""
        way = np.linalg.norm(self.experiment.position - self.experiment.position[0], axis=1)
        return self.displacements[self.state_of_row[int(np.argmax(way))]]


@dataclass(frozen=True, eq=False)
class Estimate:
    """The outcome of an estimation.

    Attributes
    ----------
    youngs_modulus : Pa
    poisson_ratio : ParameterEstimate
    correlation : of the two; zero where one of them is fixed
    rmse : over all experiments
    noise_ratio : root mean square residual in units of the sensors' stated noise; 1 where the model explains the data
    inflation : by how much the intervals were widened because the model does not explain the data within the noise
    iterates : of the fit, first to last
    forward_solves : states solved in all
    seconds : wall time
    mesh : that the fit was made on
    discretisation_force : largest change of a force component on the finer mesh, N
    fits : one for each experiment
    law : name of the material law
    shape : its shape parameters by name
    fixed : names of the parameters that were given, not estimated
    at_bound : names of the free parameters that stand at a bound
    objective : ``"likelihood"`` or ``"paper"``
    prior_shares : how much of what is known of each free parameter its prior gives, from 0 to 1, by name
    identifiability : sentences on what the measurements do not tell
    absorptions : what the fit would make of errors outside the model
    floated : what the nuisances took up; None where nobody asked
    profiles : of the likelihood, of each free parameter where intervals come from them
    budget : of uncertainty; None where nobody asked
    """

    youngs_modulus: ParameterEstimate
    poisson_ratio: ParameterEstimate
    correlation: float
    rmse: Rmse
    noise_ratio: float
    inflation: float
    iterates: tuple[Iterate, ...]
    forward_solves: int
    seconds: float
    mesh: Mesh
    discretisation_force: float
    fits: tuple[ExperimentFit, ...]
    law: str = "neo_hookean"
    shape: Mapping[str, ParameterEstimate] = field(default_factory=dict)
    fixed: tuple[str, ...] = ()
    at_bound: tuple[str, ...] = ()
    objective: str = "likelihood"
    prior_shares: Mapping[str, float] = field(default_factory=dict)
    identifiability: tuple[str, ...] = ()
    absorptions: tuple[Absorption, ...] = ()
    floated: Floated | None = None
    profiles: tuple[Profile, ...] = ()
    budget: Budget | None = None

    @property
    def parameters(self) -> dict[str, ParameterEstimate]:
        """All parameters of the material by name."""
        return {"youngs_modulus": self.youngs_modulus, "poisson_ratio": self.poisson_ratio, **self.shape}

    @property
    def below_zero(self) -> bool:
        """Whether a Poisson's ratio was estimated that no soft tissue and no elastomer has."""
        return self.poisson_ratio.value < 0 and "poisson_ratio" not in self.fixed

    def as_json(self) -> dict[str, Any]:
        """Return what ``retract estimate --json`` prints; SI units. Other programs read the keys down to ``mesh``."""
        return {
            "youngs_modulus": _parameter_json(self.youngs_modulus),
            "poisson_ratio": _parameter_json(self.poisson_ratio),
            "correlation": self.correlation,
            "rmse": {
                name: value if np.isfinite(value) else None for name, value in asdict(self.rmse).items()
            },
            "noise_ratio": self.noise_ratio,
            "iterations": len(self.iterates) - 1,
            "forward_solves": self.forward_solves,
            "seconds": self.seconds,
            "mesh": self.mesh.describe(),
            "law": self.law,
            "shape": {name: _parameter_json(value) for name, value in self.shape.items()},
            "fixed": list(self.fixed),
            "at_bound": list(self.at_bound),
            "below_zero": ["poisson_ratio"] if self.below_zero else [],
            "prior_share": dict(self.prior_shares),
            "inflation": self.inflation,
            "objective": self.objective,
            "identifiability": list(self.identifiability),
            "absorptions": [asdict(absorption) for absorption in self.absorptions],
            "floated": None if self.floated is None else _floated_json(self.floated),
            "profiles": [asdict(profile) for profile in self.profiles],
            "budget": None if self.budget is None else self.budget.as_json(),
        }


def _parameter_json(estimate: ParameterEstimate) -> dict[str, Any]:
    return {"value": estimate.value, "std": estimate.std, "interval95": list(estimate.interval95)}


def _floated_json(floated: Floated) -> dict[str, Any]:
    return {
        "tares": [tare.tolist() for tare in floated.tares],
        "rest_offsets": floated.rest_offsets.tolist(),
        "force_gain": floated.force_gain,
        "discretisation": dict(floated.discretisation),
        "least_weight": floated.least_weight,
        "rejected_share": floated.rejected_share,
    }
