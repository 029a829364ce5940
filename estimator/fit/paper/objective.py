"""The objective of the paper: a sum of squares over fiducials and forces, which are made commensurable by one factor.

    Φ(p) = Σ_k [ Σ_i ‖x_ik − x̂_ik(p)‖² + s ‖f_k − f̂_k(p)‖² ],        s = Σ_ki ‖u_ik‖² / Σ_k ‖f_k‖²

over rows k and fiducials i (eq. 1), with the automatic scale factor s (eq. 3) in the reading that displacements u and
forces f weigh the same as they were measured. Torques, tares and noise do not enter. Φ is divided by Σ ‖u‖² here, which
makes it a pure number and leaves its minimum where it is.

The estimate is linear in the measurements near its optimum, so that their covariance Σ gives its covariance,
G Σ Gᵀ with G = (Dᵀ W D)⁻¹ Dᵀ W, as for any least squares whose weights W are not the inverse covariance.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.errors import FitError
from estimator.fem.equilibrium.observation import Observation
from estimator.fit.linearised_fit import LinearisedFit, Predictions, Whitenings
from estimator.fit.measurements import StateMean
from estimator.fit.nuisances import FloatingNuisance, nuisance_columns
from estimator.inference.channels import channels_by, predicted_channels
from estimator.inference.free_parameter import FreeParameter

FloatArray = NDArray[np.float64]


def paper_system(
    means: Sequence[StateMean],
    predictions: Predictions,
    free: Sequence[FreeParameter],
    fiducials_rest: FloatArray,
) -> LinearisedFit:
    """Set up the least-squares problem whose sum of squares is Φ; it has no nuisances.

    Parameters
    ----------
    means : of all states
    predictions : of the states in use
    free : the parameters at their present values
    fiducials_rest : (m, 3), m

    Raises
    ------
    FitError
        No force or no motion of a fiducial was measured, so that there is no scale factor.
    """
    used = [mean for mean in means if mean.state in predictions[mean.experiment]]
    scale = np.sqrt(_weights(used, fiducials_rest))
    blocks = []
    for mean in used:
        observation = predictions[mean.experiment][mean.state]
        seen = (mean.count > 0) & (scale > 0)
        derivative = [channels_by(observation, p.name) * p.slope for p in free]
        raw = np.column_stack([mean.mean - predicted_channels(observation), *derivative])
        blocks.append((scale * np.sqrt(mean.count))[seen, None] * raw[seen])
    system = np.concatenate(blocks)
    return LinearisedFit.of(free, system[:, 0], system[:, 1:])


def paper_gains(
    means: Sequence[StateMean],
    predictions: Predictions,
    free: Sequence[FreeParameter],
    fiducials_rest: FloatArray,
) -> dict[tuple[int, int], FloatArray]:
    """Return G, the derivative (p, c) of the internal variables at the minimum of Φ by the mean of each channel.

    Parameters
    ----------
    means, predictions, free, fiducials_rest : as for :func:`paper_system`; every state is predicted

    Returns
    -------
    by (experiment, state)
    """
    weights = _weights(means, fiducials_rest)
    normal, weighted = np.zeros((len(free), len(free))), {}
    for mean in means:
        observation = predictions[mean.experiment][mean.state]
        derivative = np.stack([channels_by(observation, p.name) * p.slope for p in free], axis=1)
        weighted[mean.experiment, mean.state] = derivative.T * np.where(
            mean.count > 0, weights * mean.count, 0.0
        )
        normal += weighted[mean.experiment, mean.state] @ derivative
    inverse = np.linalg.inv(normal)
    return {state: inverse @ one for state, one in weighted.items()}


def paper_covariance(
    means: Sequence[StateMean],
    predictions: Predictions,
    gains: Mapping[tuple[int, int], FloatArray],
    whitenings: Whitenings,
    nuisances: Sequence[FloatingNuisance],
) -> FloatArray:
    """Return the covariance (p, p) of the internal variables at the minimum of Φ.

    Parameters
    ----------
    means, predictions : as for :func:`paper_system`; every state is predicted
    gains : from :func:`paper_gains`
    whitenings : of the states' means
    nuisances : errors that states have in common
    """
    size = len(next(iter(gains.values())))
    spread, common = np.zeros((size, size)), []
    for mean in means:
        observation = predictions[mean.experiment][mean.state]
        seen = mean.count > 0
        gain = gains[mean.experiment, mean.state][:, seen]
        noise = gain @ whitenings[mean.experiment, mean.state].root()
        spread += noise @ noise.T
        common.append(gain @ _nuisances(nuisances, mean, observation, len(predictions))[seen])
    together = sum(common, start=np.zeros_like(common[0]))
    return spread + np.asarray(together @ together.T)


def _weights(means: Sequence[StateMean], fiducials_rest: FloatArray) -> FloatArray:
    """Return the weight (c,) of each channel of a row: s/Σ‖u‖² of forces, 1/Σ‖u‖² of fiducials, none of torques."""
    motions = forces = 0.0
    for mean in means:
        squares = mean.count[6:] * np.square(mean.mean[6:] - fiducials_rest.reshape(-1))
        motions += float(np.nansum(squares))
        forces += float(np.nansum(mean.count[:3] * np.square(mean.mean[:3])))
    if not (motions > 0 and forces > 0):
        raise FitError(
            "the paper's objective weighs fiducials against forces, but these experiments lack one of them; "
            "take the likelihood as objective"
        )
    weights = np.zeros(len(means[0].mean))
    weights[:3], weights[6:] = 1 / forces, 1 / motions
    return weights


def _nuisances(
    nuisances: Sequence[FloatingNuisance], mean: StateMean, observation: Observation, experiments: int
) -> FloatArray:
    return nuisance_columns(nuisances, np.sqrt(mean.variance), observation, mean.experiment, experiments)
