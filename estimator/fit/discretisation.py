"""How far the mesh's predictions are off, measured against a finer mesh at a few states."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.observation import Observation
from estimator.fit.residuals import predicted_channels
from estimator.forward.meshing import measuring_mesh
from estimator.forward.model import ForwardModel
from estimator.forward.schedule import spread_states, travel
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

_STATES = 3


def change_on_finer_mesh(
    experiments: Sequence[Experiment],
    material: Material,
    predictions: Sequence[Mapping[int, Observation]],
    progress: Callable[[int, int], None],
) -> tuple[dict[tuple[int, int], FloatArray], int]:
    """Return by how much the finer mesh's prediction of every state differs, and how many states were solved for it.

    Between the states that are solved, the change is interpolated along the travel of the gripper: it is zero at
    rest and smooth. A state that travels back is treated as the one on the way out.

    Returns
    -------
    change : for each (experiment, state), (6 + 3m,) finer minus coarser
    solved : number of states
    """
    finer = ForwardModel(measuring_mesh(experiments[0]), experiments)
    chosen = [spread_states(schedule, _STATES) for schedule in finer.schedules]
    solved = finer.predict(material, chosen, progress)
    change = {}
    for number, schedule in enumerate(finer.schedules):
        way = travel(schedule)
        known = sorted(chosen[number], key=lambda state: way[state])
        differences = [
            predicted_channels(solved[number][s]) - predicted_channels(predictions[number][s]) for s in known
        ]
        places = np.array([0.0, *way[known]])
        table = np.vstack([np.zeros_like(differences[0]), *differences])
        for state in range(len(schedule.poses)):
            change[number, state] = np.array([np.interp(way[state], places, c) for c in table.T])
    return change, finer.solved_states
