"""What is unknown besides the material in every laboratory: nuisances that the fit lets float within their priors.

Three of them shift the channels of a state by columns times unknowns of unit variance: the tare of each experiment
(the sensor was zeroed with the noise of a row), the rest positions of the beads (measured as well as any other), and,
where it is asked for, a gain of the force sensor. Two have no unknowns: the error of the gripper's reported position
goes into the covariance of a state, and the discretisation error is measured on a finer mesh.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.fem.equilibrium.observation import Observation
from estimator.inference.channels import of_wrench, offsets

FloatArray = NDArray[np.float64]

GRIPPER_POSITION = "gripper_position"
DISCRETISATION = "discretisation"
# Full-scale accuracy of a six-axis transducer after its factory calibration, a share of the reading.
GAIN_STD = 0.01
# What remains of the discretisation error once it is corrected for, as a share of the correction: a third at second
# order with half the element size, a quarter where it was measured on blocks, a third on an organ; a half is on the
# safe side. It is a bias, so no amount of data averages it out.
REMAINING_ERROR = 0.5


@dataclass(frozen=True, slots=True)
class FloatingNuisance:
    """Unknowns that shift every state of an experiment, or of all experiments, alike.

    Attributes
    ----------
    name : in lists of nuisances
    by_experiment : whether each experiment has unknowns of its own
    columns : from the deviations (c,) of the channels of one row and the prediction, the derivative (c, k) of the
        channels by the unknowns in units of their prior deviation
    """

    name: str
    by_experiment: bool
    columns: Callable[[FloatArray, Observation], FloatArray]


def _tare(deviation: FloatArray, observation: Observation) -> FloatArray:
    del observation
    return offsets(np.where(of_wrench(len(deviation)), deviation, 0.0))


def _rest_positions(deviation: FloatArray, observation: Observation) -> FloatArray:
    del observation
    return offsets(np.where(of_wrench(len(deviation)), 0.0, deviation))


def _force_gain(deviation: FloatArray, observation: Observation) -> FloatArray:
    column = np.zeros((len(deviation), 1))
    column[:6, 0] = GAIN_STD * observation.wrench
    return column


TARE = FloatingNuisance("tare", True, _tare)
REST_POSITIONS = FloatingNuisance("rest_positions", False, _rest_positions)
FORCE_GAIN = FloatingNuisance("force_gain", False, _force_gain)

FLOATING: Mapping[str, FloatingNuisance] = MappingProxyType(
    {nuisance.name: nuisance for nuisance in (TARE, REST_POSITIONS, FORCE_GAIN)}
)
NUISANCES: tuple[str, ...] = (*FLOATING, GRIPPER_POSITION, DISCRETISATION)
USUAL: frozenset[str] = frozenset(NUISANCES) - {FORCE_GAIN.name}


def floating(names: Iterable[str]) -> tuple[FloatingNuisance, ...]:
    """Return those of the named nuisances that float, in the order of their columns.

    Raises
    ------
    InputError
        A name is unknown.
    """
    chosen = set(names)
    unknown = chosen.difference(NUISANCES)
    if unknown:
        raise InputError(f"no nuisance is called '{min(unknown)}'; choose from {', '.join(NUISANCES)}")
    return tuple(nuisance for name, nuisance in FLOATING.items() if name in chosen)


def nuisance_columns(
    nuisances: Sequence[FloatingNuisance],
    deviation: FloatArray,
    observation: Observation,
    experiment: int,
    experiments: int,
) -> FloatArray:
    """Return the derivative (c, k) of a state's channels by the unknowns of all nuisances of a case.

    Parameters
    ----------
    deviation : (c,) of the channels of one row
    observation : the state's prediction
    experiment, experiments : number of the state's experiment, and how many there are
    """
    blocks = [np.zeros((len(deviation), 0))]
    for nuisance in nuisances:
        own = nuisance.columns(deviation, observation)
        if nuisance.by_experiment:
            repeated = np.zeros((len(own), experiments, own.shape[1]))
            repeated[:, experiment] = own
            own = repeated.reshape(len(own), -1)
        blocks.append(own)
    return np.hstack(blocks)
