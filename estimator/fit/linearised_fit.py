"""The whitened misfit between measurements and prediction, with the nuisances that every laboratory has.

With n rows, prediction f(θ) and its derivative T by the gripper's pose, a state's mean measurement is

    ȳ = f(θ) + T δ + tare + rest offsets + noise,     cov = σ²/n + T Σ_p Tᵀ/n

where δ is the error of the reported pose (Σ_p a row), the tare is that of the experiment (the sensor was zeroed
with the noise of a row), and the rest offsets are those of the beads' stated rest positions. δ goes into the whitening
of each state; the others are errors that states share, with priors (:mod:`estimator.fit.nuisances`), by which all
states are whitened together. Least squares then is the marginal maximum likelihood (Kaipio & Somersalo 2005,
section 5.8).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fem.equilibrium.observation import Observation
from estimator.fit.measurements import StateMean
from estimator.fit.nuisances import USUAL, FloatingNuisance, floating, nuisance_columns
from estimator.inference.channels import channels_by, channels_by_pose, predicted_channels
from estimator.inference.free_parameter import FreeParameter
from estimator.inference.whitening import Whitening, inverse_root, shrunk

FloatArray = NDArray[np.float64]
# Of the mean of each predicted state, by (experiment, state).
Whitenings = Mapping[tuple[int, int], Whitening]
# For each experiment, the observation of each solved state.
Predictions = Sequence[Mapping[int, Observation]]


@dataclass(frozen=True, eq=False)
class LinearisedFit:
    """The least-squares problem at the values of its free parameters, in one block.

    Attributes
    ----------
    free_parameters : the p parameters at these values
    residual : one (r,), measured minus predicted, whitened
    jacobian : one (r, p), derivative of the prediction by each internal variable
    by_nuisance : (r, k) derivative by each nuisance in units of its prior's deviation, whitened but for these
    vectors, shrink : by which the nuisances are whitened out, as those of a :class:`Whitening`
    """

    free_parameters: tuple[FreeParameter, ...]
    residual: tuple[FloatArray]
    jacobian: tuple[FloatArray]
    by_nuisance: FloatArray
    vectors: FloatArray
    shrink: FloatArray

    @classmethod
    def of(
        cls,
        free: Sequence[FreeParameter],
        residual: FloatArray,
        jacobian: FloatArray,
        by_nuisance: FloatArray | None = None,
    ) -> "LinearisedFit":
        """Whiten a residual (r,) and derivatives (r, p) by the nuisances (r, k) that they share; by default by none."""
        nuisances = np.zeros((len(residual), 0)) if by_nuisance is None else by_nuisance
        vectors, shrink = inverse_root(nuisances)
        whitened = shrunk(np.column_stack([residual, jacobian]), vectors, shrink)
        return cls(tuple(free), (whitened[:, 0],), (whitened[:, 1:],), nuisances, vectors, shrink)

    def whitened(self, columns: FloatArray) -> FloatArray:
        """Whiten further columns (r, k), whitened state by state, by the nuisances as well."""
        return shrunk(columns, self.vectors, self.shrink)

    def nuisances_after(self, step: FloatArray) -> FloatArray:
        """Return the nuisances (k,) at their best after a step (p,), in units of their priors' deviations.

        With errors N η and the whitening S of I + N Nᵀ that is Nᵀ S² (r − J δ).
        """
        left = self.residual[0] - self.jacobian[0] @ step
        return np.asarray(self.by_nuisance.T @ self.whitened(left[:, None])[:, 0])


def whitenings_of(means: Sequence[StateMean], predictions: Predictions) -> Whitenings:
    """Return the whitening of every predicted state's mean, by (experiment, state).

    It depends on the prediction through its derivative by the gripper's pose. A fit keeps it fixed, so that its
    misfit is a function of the parameters that a Gauss–Newton step lowers.
    """
    found = {}
    for mean in means:
        observation = predictions[mean.experiment].get(mean.state)
        if observation is None:
            continue
        seen = mean.count > 0
        deviation = np.sqrt(np.divide(mean.variance, mean.count, out=np.ones(len(seen)), where=seen))
        by_pose = channels_by_pose(observation) * np.sqrt(mean.pose_variance)
        shared = inverse_root((by_pose / deviation[:, None])[seen])
        found[mean.experiment, mean.state] = Whitening(seen[None], deviation, np.zeros(len(seen)), *shared)
    return found


def linearised_fit(
    means: Sequence[StateMean],
    predictions: Predictions,
    free: Sequence[FreeParameter],
    whitenings: Whitenings,
    nuisances: Sequence[FloatingNuisance] = floating(USUAL),
) -> LinearisedFit:
    """Set up the least-squares problem for the states that were predicted.

    Parameters
    ----------
    means : of all states
    predictions : of the states in use, at the values of the free parameters
    free : the parameters at these values
    whitenings : of the states, from :func:`whitenings_of`
    nuisances : that float
    """

    def columns(mean: StateMean, observation: Observation) -> FloatArray:
        error = mean.mean - predicted_channels(observation)
        derivative = [channels_by(observation, p.name) * p.slope for p in free]
        deviation = np.sqrt(mean.variance)
        floats = nuisance_columns(nuisances, deviation, observation, mean.experiment, len(predictions))
        return np.column_stack([error, *derivative, floats])

    system = whitened_rows(means, predictions, whitenings, columns)
    residual, by_parameter, by_nuisance = np.split(system, [1, 1 + len(free)], axis=1)
    return LinearisedFit.of(free, residual[:, 0], by_parameter, by_nuisance)


def whitened_rows(
    means: Sequence[StateMean],
    predictions: Predictions,
    whitenings: Whitenings,
    columns: Callable[[StateMean, Observation], FloatArray],
) -> FloatArray:
    """Return columns (c, k) of every predicted state one below the other, whitened, without what was not measured."""
    blocks = []
    for mean in means:
        observation = predictions[mean.experiment].get(mean.state)
        if observation is not None:
            raw = columns(mean, observation)
            blocks.append(whitenings[mean.experiment, mean.state].apply(raw[None]))
    return np.concatenate(blocks)
