"""How far a mesh's predictions are off: what a finer one changes of a few states, carried along its travel."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from estimator.fem.equilibrium.newton import NewtonSettings
from estimator.fem.equilibrium.observation import Observation
from estimator.forward.model import ForwardModel
from estimator.forward.schedule import PoseSchedule, spread_states, travel
from estimator.inference.channels import predicted_channels
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
# From the travel (k,) of a few states and what is known there (k, c), what it is at any travel (s,), (s, c).
Course = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]

_STATES = 3
# Nobody asks for derivatives on the finer mesh.
NEWTON_ON_FINER_MESH = NewtonSettings(tolerance=1e-7, chord_rate=0.3, tangent_reuse=np.inf)


def smooth(known_at: FloatArray, known: FloatArray, at: FloatArray) -> FloatArray:
    """Interpolate by a monotone cubic spline (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. 5 (1984) 300)."""
    return np.asarray(PchipInterpolator(known_at, known)(at))


def straight(known_at: FloatArray, known: FloatArray, at: FloatArray) -> FloatArray:
    """Interpolate linearly."""
    return np.array([np.interp(at, known_at, column) for column in known.T]).T


def change_along(schedule: PoseSchedule, change: Mapping[int, FloatArray], course: Course) -> FloatArray:
    """Return the change (s, c) of every state from that (c,) of a few, interpolated along the travel of the gripper.

    It is smooth, and zero in the first state where that is not among those given: tissue at rest is at rest on every
    mesh. A state that travels back is treated as the one on the way out, one beyond the last that is known as that.
    """
    way = travel(schedule)
    known = {0: np.zeros_like(next(iter(change.values()))), **change}
    ordered = sorted(known, key=lambda state: way[state])
    if len(ordered) == 1:  # a gripper that stood throughout
        return np.tile(known[ordered[0]], (len(way), 1))
    return course(
        way[ordered], np.array([known[state] for state in ordered]), np.minimum(way, way[ordered[-1]])
    )


def change_in_another_model(
    other: ForwardModel,
    material: Material,
    predictions: Sequence[Mapping[int, Observation]],
    progress: Callable[[int, int], None],
) -> dict[tuple[int, int], FloatArray]:
    """Return what a finer mesh, or another body, changes of the predictions: by (experiment, state), (6 + 3m,)."""
    chosen = [spread_states(schedule, _STATES) for schedule in other.schedules]
    solved = other.predict(material, chosen, progress, NEWTON_ON_FINER_MESH)
    change = {}
    for number, schedule in enumerate(other.schedules):
        of_few = {
            s: predicted_channels(solved[number][s]) - predicted_channels(predictions[number][s])
            for s in chosen[number]
        }
        for state, of_state in enumerate(change_along(schedule, of_few, straight)):
            change[number, state] = of_state
    return change
