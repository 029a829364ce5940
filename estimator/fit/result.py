"""What an estimation returns."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.mesh import Mesh
from estimator.fit.gauss_newton import Iterate

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ParameterEstimate:
    """A value with its standard deviation and its 95 % interval, which need not be symmetric."""

    value: float
    std: float
    interval95: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Rmse:
    """Root mean square of measured minus predicted, a component: force in N, torque in N·m, fiducials in m."""

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
    displacement : (p, 3) nodal displacements at the state farthest from rest, m
    wrench_std, fiducials_std : like those, what noise gives the residuals: the sensors', and that of the gripper's
        reported position
    """

    experiment: Experiment
    wrench: FloatArray
    fiducials: FloatArray
    displacement: FloatArray
    wrench_std: FloatArray
    fiducials_std: FloatArray


@dataclass(frozen=True, eq=False)
class Estimate:
    """The outcome of an estimation.

    Attributes
    ----------
    youngs_modulus : Pa
    poisson_ratio : ParameterEstimate
    correlation : of the two
    rmse : over all experiments
    noise_ratio : root mean square residual in units of the sensors' stated noise; 1 where the model explains the data
    inflation : by how much the intervals were widened because the model does not explain the data within the noise
    iterates : of the fit, first to last
    forward_solves : states solved in all
    seconds : wall time
    mesh : that the fit was made on
    discretisation_force : largest change of a force component on the finer mesh, N
    fits : one for each experiment
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

    def as_json(self) -> dict[str, Any]:
        """Return the fixed shape that ``retract estimate --json`` prints; SI units."""
        return {
            "youngs_modulus": _parameter_json(self.youngs_modulus),
            "poisson_ratio": _parameter_json(self.poisson_ratio),
            "rmse": {
                "force": self.rmse.force,
                "torque": self.rmse.torque,
                "fiducials": self.rmse.fiducials,
            },
            "noise_ratio": self.noise_ratio,
            "iterations": len(self.iterates) - 1,
            "forward_solves": self.forward_solves,
            "seconds": self.seconds,
            "mesh": self.mesh.describe(),
        }


def _parameter_json(estimate: ParameterEstimate) -> dict[str, Any]:
    return {"value": estimate.value, "std": estimate.std, "interval95": list(estimate.interval95)}
