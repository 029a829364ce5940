"""Where a fit begins: Young's modulus from one prediction, to which all forces but weight are proportional."""

from collections.abc import Sequence

import numpy as np

from estimator.errors import FitError
from estimator.experiment.observations import WRENCH_COLUMNS
from estimator.fit.linearised_fit import Predictions
from estimator.fit.measurements import StateMean
from estimator.forward.schedule import PoseSchedule
from estimator.inference.channels import channels_by, predicted_channels
from estimator.inference.material_parameters import YOUNGS_MODULUS

# A mean that is this many of its deviations against the motion is no noise.
_SURELY = 3.0
_FORCE, _TORQUE = slice(0, 3), slice(3, 6)
_REMEDY = "fix youngs_modulus or give it a prior, or measure along the motion"


class NothingTellsModulusError(FitError):
    """No force was measured, or none that stands out of its noise."""


def modulus_ratio(
    means: Sequence[StateMean], predictions: Predictions, schedules: Sequence[PoseSchedule], modulus: float
) -> float:
    """Return by what the modulus of a prediction is to be multiplied for it to fit what was measured.

    Beside weight that is the first of some steps: what it does to the tissue goes by its ratio to the modulus.
    Every component counts in the rows where it was measured, by its noise; torques where there is no force at all.
    Where the prediction is far from what was measured, as beside forces that the model does not know, their sizes are
    compared.

    Parameters
    ----------
    means : of all states
    predictions : of the states in use
    schedules : of the experiments, whose poses tell the motion
    modulus : of the predictions, Pa

    Raises
    ------
    NothingTellsModulusError
        No force was measured, or none that stands out of its noise; the message tells which.
    FitError
        The measured force does not oppose the motion.
    """
    used = [mean for mean in means if mean.state in predictions[mean.experiment]]
    chosen = _FORCE if any((mean.count[_FORCE] > 0).any() for mean in used) else _TORQUE
    along, predicted_squared, measured_squared, work = 0.0, 0.0, 0.0, 0.0
    names: set[str] = set()
    for mean in used:
        seen = np.flatnonzero(mean.count[chosen] > 0)
        prediction = predictions[mean.experiment][mean.state]
        predicted = modulus * channels_by(prediction, YOUNGS_MODULUS.name)[chosen][seen]
        of_weight = predicted_channels(prediction)[chosen][seen] - predicted
        measured = mean.mean[chosen][seen] - of_weight
        weight = (mean.count[chosen] / mean.variance[chosen])[seen]
        poses = schedules[mean.experiment].poses
        along += float(weight * predicted @ measured)
        predicted_squared += float(weight * predicted @ predicted)
        measured_squared += float(weight * measured @ measured)
        work += float(measured @ poses[0].increment_to(poses[mean.state])[chosen][seen])
        names.update(WRENCH_COLUMNS[chosen][number] for number in seen)
    if not names:
        raise NothingTellsModulusError(f"no force was measured, which alone tells Young's modulus; {_REMEDY}")
    label = " ".join(name for name in WRENCH_COLUMNS if name in names)
    if along < -_SURELY * np.sqrt(predicted_squared) and work > 0.0:
        raise FitError(
            "the measured force does not oppose the motion as an elastic tissue's would; "
            f"check the sign and the axes of {label}, and that the gripper holds the tissue"
        )
    if not predicted_squared > 0 or (
        not along > 0 and not measured_squared > len(used) * len(names) * _SURELY**2
    ):
        raise NothingTellsModulusError(
            f"of the measured {label} nothing stands out of the noise where the tissue would resist; {_REMEDY}"
        )
    sizes = np.sqrt(measured_squared / predicted_squared)
    return float(along / predicted_squared if along > 0 else sizes)
