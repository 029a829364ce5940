"""What systematic errors change of the means of all states.

Errors of motion and sensors change rows by the prediction and its derivative by the gripper's pose. Errors of the
geometry change the mechanics: these are solved anew on the body as it would be, at a few states of each experiment, as
the discretisation error is.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.shared.row_changes import PredictedRows, change_of_rows
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fit.budget.systematic import Acting, Systematic
from estimator.fit.linearised_fit import Predictions
from estimator.forward.model import ForwardModel
from estimator.forward.schedule import PoseSchedule
from estimator.inference.discretisation import change_in_another_model
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
Changes = dict[tuple[int, int], FloatArray]

# Phases in which the gripper moves.
_UNDER_WAY = ("ramp", "return")


def changes_of_rows(
    one: Systematic,
    size: float,
    experiments: Sequence[Experiment],
    schedules: Sequence[PoseSchedule],
    predictions: Predictions,
) -> Changes:
    """Return by how much an error of motion or sensors changes the means of the states.

    Returns
    -------
    by (experiment, state), (6 + 3m, k) for its k components
    """
    found: Changes = {}
    for number, (experiment, schedule) in enumerate(zip(experiments, schedules, strict=True)):
        predicted = PredictedRows(
            experiment,
            [schedule.poses[state] for state in schedule.state_of_row],
            [predictions[number][state] for state in schedule.state_of_row.tolist()],
        )
        rows = np.stack([change_of_rows(predicted, acting) for acting in one.acting(size)], axis=-1)
        if one.under_way:
            moving = np.array([phase in _UNDER_WAY for phase in experiment.phase])
            rows[~moving] = 0.0
        for state in range(len(schedule.poses)):
            found[number, state] = rows[schedule.state_of_row == state].mean(axis=0)
    return found


def changes_of_mechanics(
    one: Systematic,
    size: float,
    experiments: Sequence[Experiment],
    solved: tuple[RetractionProblem, Material, Predictions],
    progress: Callable[[int, int], None],
) -> Changes:
    """Return the same of an error of the geometry.

    Parameters
    ----------
    solved : the problem, its material, and the predictions of all states
    progress : called with how many states are solved, and how many there are
    """
    problem, material, predictions = solved
    components: list[Mapping[tuple[int, int], FloatArray]] = []
    for acting in one.acting(size):
        model = ForwardModel(_with_errors(problem, acting), experiments)
        components.append(change_in_another_model(model, material, predictions, progress))
    return {state: np.stack([c[state] for c in components], axis=-1) for state in components[0]}


def _with_errors(problem: RetractionProblem, acting: Sequence[Acting]) -> RetractionProblem:
    for effect, values in acting:
        problem = effect.problem(problem, values)
    return problem
