"""Where a fit begins: Young's modulus from one prediction, to which every force is proportional."""

from collections.abc import Sequence

import numpy as np

from estimator.errors import FitError
from estimator.experiment.observations import WRENCH_COLUMNS
from estimator.fit.linearised_fit import Predictions
from estimator.fit.measurements import StateMean
from estimator.inference.channels import predicted_channels

# A mean that is this many of its deviations against the motion is no noise.
_SURELY = 3.0
_FORCE, _TORQUE = slice(0, 3), slice(3, 6)
_REMEDY = "fix youngs_modulus or give it a prior, or measure along the motion"


class NothingTellsModulusError(FitError):
    """No force was measured, or none that stands out of its noise."""


def modulus_ratio(means: Sequence[StateMean], predictions: Predictions) -> float:
    """Return by what the modulus of a prediction is to be multiplied for it to fit what was measured.

    Every component counts in the rows where it was measured, by its noise; torques where there is no force at all.

    Parameters
    ----------
    means : of all states
    predictions : of the states in use

    Raises
    ------
    NothingTellsModulusError
        No force was measured, or none that stands out of its noise; the message tells which.
    FitError
        The measured force does not oppose the motion.
    """
    used = [mean for mean in means if mean.state in predictions[mean.experiment]]
    chosen = _FORCE if any((mean.count[_FORCE] > 0).any() for mean in used) else _TORQUE
    along, squared = 0.0, 0.0
    names: set[str] = set()
    for mean in used:
        seen = np.flatnonzero(mean.count[chosen] > 0)
        predicted = predicted_channels(predictions[mean.experiment][mean.state])[chosen][seen]
        weight = (mean.count[chosen] / mean.variance[chosen])[seen]
        along += float(weight * predicted @ mean.mean[chosen][seen])
        squared += float(weight * predicted @ predicted)
        names.update(WRENCH_COLUMNS[chosen][number] for number in seen)
    if not names:
        raise NothingTellsModulusError(f"no force was measured, which alone tells Young's modulus; {_REMEDY}")
    measured = " ".join(name for name in WRENCH_COLUMNS if name in names)
    if along < -_SURELY * np.sqrt(squared):
        raise FitError(
            "the measured force does not oppose the motion as an elastic tissue's would; "
            f"check the sign and the axes of {measured}, and that the gripper holds the tissue"
        )
    if not along > 0:
        raise NothingTellsModulusError(
            f"of the measured {measured} nothing stands out of the noise where the tissue would resist; {_REMEDY}"
        )
    return along / squared
