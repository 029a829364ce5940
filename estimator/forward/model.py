"""The forward model of a case: what its sensors would read, for any material."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.fem.equilibrium import EquilibriumSolver, EquilibriumState
from estimator.fem.observation import Observation, observe
from estimator.fem.problem import RetractionProblem
from estimator.forward.schedule import PoseSchedule, schedule_poses
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
Progress = Callable[[int, int], None]


@dataclass
class _Track:
    """An experiment with its states, and the last solution of each."""

    schedule: PoseSchedule
    fields: dict[int, "_Solution"] = field(default_factory=dict)


@dataclass(frozen=True)
class _Solution:
    material: Material
    displacement: FloatArray
    pressure: FloatArray
    field_by: dict[str, FloatArray]


class ForwardModel:
    """Predicts the observations of several experiments on one phantom in one mounting.

    It remembers the last solution of every state: a prediction for a material near the last one starts there.

    Parameters
    ----------
    problem : the retraction, common to all experiments
    experiments : whose gripper motion drives it
    """

    def __init__(self, problem: RetractionProblem, experiments: Sequence[Experiment]) -> None:
        self.problem = problem
        self.schedules = tuple(schedule_poses(experiment) for experiment in experiments)
        self.solved_states = 0
        self._solver = EquilibriumSolver(problem)
        self._tracks = [_Track(schedule) for schedule in self.schedules]

    def predict(
        self, material: Material, selection: Sequence[Sequence[int]], progress: Progress | None = None
    ) -> list[dict[int, Observation]]:
        """Return, for each experiment, the observations of the selected states by their number.

        Parameters
        ----------
        material : Material
        selection : for each experiment the states to solve, in the order of the motion
        progress : called with (states done, states in all)

        Raises
        ------
        SolverError
            A state has no equilibrium for this material.
        """
        total, done = sum(len(states) for states in selection), 0
        result = []
        for track, states in zip(self._tracks, selection, strict=True):
            last, observations = None, {}
            for number in states:
                last = self._solve(track, number, material, last)
                observations[number] = observation = observe(self.problem, last)
                track.fields[number] = _Solution(
                    material, last.displacement, last.response.pressure, observation.field_by
                )
                done += 1
                if progress is not None:
                    progress(done, total)
            result.append(observations)
        self.solved_states += total
        return result

    def deformed(self, experiment: int, state: int) -> FloatArray:
        """Return the last solved nodal displacements (n, 3) of a state, m."""
        return self._tracks[experiment].fields[state].displacement

    def _solve(
        self, track: _Track, number: int, material: Material, last: EquilibriumState | None
    ) -> EquilibriumState:
        pose = track.schedule.poses[number]
        known = track.fields.get(number)
        if known is not None:
            try:
                return self._solver.refine(pose, material, *self._carried_over(known, material))
            except SolverError:
                # The material has moved too far for the old field; follow the motion instead.
                pass
        return self._solver.solve(pose, material, last or self._solver.rest(material))

    def _carried_over(self, known: _Solution, material: Material) -> tuple[FloatArray, FloatArray]:
        """Extrapolate known displacements and pressures to another material of the same law.

        The field follows −ln(1 − 2ν), in which it is nearly linear, and the shape parameters; Young's modulus leaves
        it as it is and multiplies the pressure.
        """
        old, new = known.material.poisson_ratio, material.poisson_ratio
        change = {"poisson_ratio": 0.5 * (1 - 2 * old) * math.log((1 - 2 * old) / (1 - 2 * new))}
        for n, parameter in enumerate(material.law.shape_parameters):
            change[parameter.name] = float(material.shape[n] - known.material.shape[n])
        guess = known.displacement.copy().reshape(-1)
        for name, amount in change.items():
            guess[self.problem.pattern.free] += amount * known.field_by[name]
        pressure = known.pressure * (material.youngs_modulus / known.material.youngs_modulus)
        return guess.reshape(known.displacement.shape), pressure
