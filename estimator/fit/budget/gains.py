"""The gain of an estimate: its derivative by what was measured, the sensitivity coefficients of the GUM.

Near its optimum the fit is linear in the measured means ȳ, with the information A of data and priors, the whitened
derivatives J and the whitening W by the noise and by the nuisances, ẑ = A⁻¹ Jᵀ W ȳ + ..., so that its gain is

    G = ∂ẑ/∂ȳ = A⁻¹ Jᵀ W.

An error with the covariance Σ of the means adds G Σ Gᵀ to the covariance of the estimate whether the fit knows of it or
not. If the fit knows of all of them, these and what the priors leave, A⁻¹ P A⁻¹, add up to A⁻¹ exactly. A nuisance that
the fit estimates itself, such as the tare, is in W: what is left of it in G N is what the estimate could not find out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.equilibrium.observation import Observation
from estimator.fit.linearised_fit import Predictions, linearised_fit, whitenings_of
from estimator.fit.measurements import StateMean
from estimator.fit.nuisances import GRIPPER_POSITION, floating
from estimator.fit.paper.objective import paper_gains
from estimator.forward.schedule import PoseSchedule
from estimator.inference.channels import channels_by_pose
from estimator.inference.free_parameter import FreeParameter, prior_information

FloatArray = NDArray[np.float64]
# By (experiment, state), the derivative (p, c) of the internal variables by the mean of each channel.
Gains = Mapping[tuple[int, int], FloatArray]


@dataclass(frozen=True, eq=False)
class Response:
    """How an estimate answers.

    Attributes
    ----------
    gains : by the measured means
    by_prior : (p, p) derivative of the internal variables by the means of their priors
    """

    gains: Gains
    by_prior: FloatArray


@dataclass(frozen=True, eq=False)
class FittedCase:
    """What a budget has to know of a finished fit.

    Attributes
    ----------
    experiments, schedules : that it was made of
    means : of all states, with what of the pose's error counts beside their scatter
    predictions : of all states, at the values of the parameters
    free : the parameters there, with priors as sure as they were told
    nuisances : names of those that the fit knows of
    inflation : by how much the measurements scatter more than stated, at least one
    paper_rest : (m, 3) rest positions of the beads, m, where the objective is the paper's; else None
    """

    experiments: Sequence[Experiment]
    schedules: Sequence[PoseSchedule]
    means: Sequence[StateMean]
    predictions: Predictions
    free: tuple[FreeParameter, ...]
    nuisances: frozenset[str]
    inflation: float
    paper_rest: FloatArray | None = None
    prior: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        known = prior_information(self.free) if self.paper_rest is None else np.zeros((len(self.free),) * 2)
        object.__setattr__(self, "prior", known)

    @property
    def channels(self) -> int:
        """How many channels there are, 6 + 3m."""
        return len(self.means[0].mean)

    @property
    def pose_known(self) -> bool:
        """Whether the fit knows that the reported pose is noisy."""
        return GRIPPER_POSITION in self.nuisances

    def pose_variance(self, mean: StateMean) -> FloatArray:
        """Return the variance (6,) of the mean pose of a state, m² and rad²: as the fit has it, or as it is stated."""
        if self.pose_known:
            return self.inflation**2 * mean.pose_variance
        rows = int(self.schedules[mean.experiment].rows_per_state[mean.state])
        return np.asarray(self.experiments[mean.experiment].sensor.pose_std ** 2 / rows)

    def observation(self, mean: StateMean) -> Observation:
        """Return the prediction of a state."""
        return self.predictions[mean.experiment][mean.state]


def response_of(case: FittedCase) -> Response:
    """Return how a finished fit answers to what was measured, and to what its priors say."""
    if case.paper_rest is not None:
        # The weights of the paper's objective are not those of the noise.
        gains = paper_gains(case.means, case.predictions, case.free, case.paper_rest)
        return Response(gains, np.zeros_like(case.prior))
    whitenings = whitenings_of(case.means, case.predictions)
    problem = linearised_fit(case.means, case.predictions, case.free, whitenings, floating(case.nuisances))
    (jacobian,) = problem.jacobian
    covariance = np.linalg.inv(jacobian.T @ jacobian / case.inflation**2 + case.prior)
    by_whitened = problem.whitened(jacobian @ covariance).T / case.inflation**2
    found, start = {}, 0
    for mean in case.means:
        whitening = whitenings[mean.experiment, mean.state]
        rows = int(whitening.seen.sum())
        found[mean.experiment, mean.state] = whitening.derivative(by_whitened[:, start : start + rows])[:, 0]
        start += rows
    return Response(found, covariance @ case.prior)


def pose_gain(gains: Gains, case: FittedCase, mean: StateMean) -> FloatArray:
    """Return the derivative (p, 6) of the internal variables by the gripper's position and turn in a state."""
    return gains[mean.experiment, mean.state] @ channels_by_pose(case.observation(mean))
