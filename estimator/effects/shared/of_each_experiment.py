"""An error of an instrument that is another one in each experiment: set anew, knocked, or warmer by then.

The plain form of such an effect has one size throughout. Here every experiment has a size of its own, each with the
plain form's prior, so that a mean of nothing and a knock between two experiments are as likely as any. An experiment
that is left out tells nothing of its own size.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Effect, Motion, Readings, Values
from estimator.effects.shared.sensor_steps import SensorStep, ToldInSteps
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]

# The three standard retractions, where nothing else is planned.
_STANDARD = (1, 2, 3)


class OfEachExperiment(Effect):
    """The base of what changes readings, of what cameras see, and of what changes the gripper's motion.

    A subclass inherits one of these, and the plain effect's class for its label, group and words.

    Parameters
    ----------
    single : the plain form, of one size throughout
    orders : numbers of the experiments, from 1 in the order of time

    Examples
    --------
    >>> from estimator.effects.motion.motion_scale import MotionScale, MotionScaleOfEach
    >>> [one.name for one in MotionScaleOfEach(MotionScale(), (1, 2)).amplitudes]
    ['scale_error_in_experiment_1', 'scale_error_in_experiment_2']
    """

    fewest_experiments = 2

    def __init__(self, single: Effect, orders: Sequence[int] = _STANDARD) -> None:
        self.single = single
        self.form = f"{single.form}_of_each_experiment" if single.form else "of_each_experiment"
        self.amplitudes = tuple(
            replace(one, name=_name(one.name, order)) for order in orders for one in single.amplitudes
        )

    def looked_for_in(self, experiments: Sequence[Experiment]) -> Self:
        """Return the effect with a size for each of these experiments."""
        return type(self)(self.single, sorted({one.order for one in experiments}))

    def _own(self, values: Values, experiment: Experiment) -> Mapping[str, float]:
        """Return the size in one experiment; none in one that is not among these."""
        return {
            one.name: values.get(_name(one.name, experiment.order), 0.0) for one in self.single.amplitudes
        }


class ReadingsOfEachExperiment(OfEachExperiment):
    """What the sensors read is off by another size in each experiment.

    Raises
    ------
    TypeError
        The plain form does not tell what it does to readings in steps.
    """

    def __init__(self, single: Effect, orders: Sequence[int] = _STANDARD) -> None:
        super().__init__(single, orders)
        if not isinstance(single, ToldInSteps):
            raise TypeError(f"{single.name} does not tell what it does to readings; give it sensor_steps")
        self._steps = single

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Change the readings by the experiment's own size."""
        return self.single.readings(readings, self._own(values, readings.experiment))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return those of the plain form with the experiment's own size."""
        return self._steps.sensor_steps(experiment, self._own(values, experiment))


class SeenOfEachExperiment(ReadingsOfEachExperiment):
    """What cameras see is off by another size in each experiment; the rest positions were measured beforehand."""

    def seen(self, positions: FloatArray, values: Values) -> FloatArray:
        """Return the positions: in no experiment yet."""
        return positions


class MotionOfEachExperiment(OfEachExperiment):
    """What the robot does is off by another size in each experiment."""

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Change the motion by the experiment's own size."""
        return self.single.motion(motion, self._own(values, motion.experiment))


def _name(name: str, order: int) -> str:
    return f"{name}_in_experiment_{order}"
