"""How far the mesh's predictions are off, measured against a finer mesh at a few states."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.fem.equilibrium.newton import NewtonSettings
from estimator.fem.equilibrium.observation import Observation
from estimator.fit.residuals import predicted_channels
from estimator.forward.model import ForwardModel
from estimator.forward.schedule import spread_states, travel
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

_STATES = 3
# Nobody asks for derivatives on the finer mesh.
_NEWTON = NewtonSettings(tolerance=1e-7, chord_rate=0.3, tangent_reuse=np.inf)


def change_on_finer_mesh(
    finer: ForwardModel,
    material: Material,
    predictions: Sequence[Mapping[int, Observation]],
    progress: Callable[[int, int], None],
) -> dict[tuple[int, int], FloatArray]:
    """Return by how much the finer mesh's prediction of every state differs: for each (experiment, state), (6 + 3m,).

    Between the states that are solved, the change is interpolated along the travel of the gripper: it is zero at
    rest and smooth. A state that travels back is treated as the one on the way out.
    """
    chosen = [spread_states(schedule, _STATES) for schedule in finer.schedules]
    solved = finer.predict(material, chosen, progress, _NEWTON)
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
    return change
