"""The forward model of a case: what its sensors would read, for any material."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.observation import Observation, observe, zeroed
from estimator.fem.equilibrium.settling import settled
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.forward.schedule import PoseSchedule, schedule_poses
from estimator.forward.solution import Guess, Solution, between, carried_over
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
Progress = Callable[[int, int], None]

_EXACT = NewtonSettings()


@dataclass
class _Track:
    """An experiment with its states, and the last solution of each.

    ``zeroed`` tells whether the sensor was zeroed in its first state, in which the tissue pulls at the gripper.
    """

    schedule: PoseSchedule
    zeroed: bool
    solutions: dict[int, Solution] = field(default_factory=dict)

    def scale(self, material: Material) -> None:
        """Bring the solutions that differ from a material in Young's modulus alone to it."""
        for number, known in self.solutions.items():
            if known.scales_to(material):
                self.solutions[number] = known.at_modulus(material)

    def lacks(self, number: int, material: Material, newton: NewtonSettings) -> bool:
        """Tell whether a state is still to be solved for a material, as exactly."""
        known = self.solutions.get(number)
        return known is None or known.newton != newton or not known.is_of(material)

    def neighbours(self, number: int, material: Material) -> tuple[Solution | None, Solution | None]:
        """Return the material's solutions next before and next after a state."""
        own = [n for n, known in self.solutions.items() if known.is_of(material)]
        before = max((n for n in own if n < number), default=None)
        after = min((n for n in own if n > number), default=None)
        return self._solution(before), self._solution(after)

    def observation(self, number: int) -> Observation:
        """Return what the sensors see of a solved state."""
        seen = self.solutions[number].observation
        if not self.zeroed:
            return seen
        first = self.schedule.poses[0]
        turn = self.schedule.poses[number].rotation * first.rotation.inv()
        return zeroed(seen, self.solutions[0].observation, turn)

    def _solution(self, number: int | None) -> Solution | None:
        return None if number is None else self.solutions[number]


class ForwardModel:
    """Predicts the observations of several experiments on one phantom in one mounting.

    It remembers the last solution of every state: a prediction for a material near the last one starts there.

    Parameters
    ----------
    problem : the retraction, common to all experiments
    experiments : whose gripper motion drives it

    Attributes
    ----------
    driven_by_load : of each experiment, whether its gripper was free, so that its poses were measured
    """

    def __init__(self, problem: RetractionProblem, experiments: Sequence[Experiment]) -> None:
        self.problem = problem
        self.driven_by_load = tuple(experiment.driven == "load" for experiment in experiments)
        self.schedules = tuple(schedule_poses(experiment) for experiment in experiments)
        self.solved_states = 0
        self._solver = EquilibriumSolver(problem)
        self._tracks = [
            _Track(schedule, experiment.zeroed_under_load)
            for schedule, experiment in zip(self.schedules, experiments, strict=True)
        ]

    def predict(
        self,
        material: Material,
        selection: Sequence[Sequence[int]],
        progress: Progress | None = None,
        newton: NewtonSettings = _EXACT,
    ) -> list[dict[int, Observation]]:
        """Return, for each experiment, the observations of the selected states by their number.

        A state of tissue without weight whose last solution differs in Young's modulus alone is not solved again.

        Parameters
        ----------
        material : Material
        selection : for each experiment the states to solve, in the order of the motion
        progress : called with (states done, states to solve)
        newton : how exactly

        Raises
        ------
        SolverError
            A state has no equilibrium for this material.
        """
        if not self.problem.heavy:
            for track in self._tracks:
                track.scale(material)
        to_solve = [
            [number for number in self._needed(track, states) if track.lacks(number, material, newton)]
            for track, states in zip(self._tracks, selection, strict=True)
        ]
        solver, done = self._solver.with_settings(newton), 0
        for track, states in zip(self._tracks, to_solve, strict=True):
            last = None
            for number in states:
                last = _solved(solver, track, number, material, last)
                track.solutions[number] = Solution.of(last, newton, observe(self.problem, last))
                done += 1
                if progress is not None:
                    progress(done, sum(map(len, to_solve)))
        self.solved_states += done
        return [
            {number: track.observation(number) for number in states}
            for track, states in zip(self._tracks, selection, strict=True)
        ]

    @staticmethod
    def _needed(track: _Track, states: Sequence[int]) -> list[int]:
        """Return the states to solve, in the order of the motion: where the sensor was zeroed, the first as well."""
        return [0, *(number for number in states if number)] if track.zeroed else list(states)

    def deformed(self, experiment: int, state: int) -> FloatArray:
        """Return the last solved nodal displacements (n, 3) of a state, m."""
        return self._tracks[experiment].solutions[state].displacement


def _solved(
    solver: EquilibriumSolver, track: _Track, number: int, material: Material, last: EquilibriumState | None
) -> EquilibriumState:
    """Solve a state from what is known near it; where that is nothing, or too far, follow the motion from ``last``."""
    pose = track.schedule.poses[number]
    before, after = track.neighbours(number, material)
    known = track.solutions.get(number)
    guess: Guess | None = None
    if known is not None:
        guess = carried_over(solver.problem, known, material)
    elif before is not None and after is not None:
        guess = between(solver.problem, before, after, pose)
    if guess is not None:
        try:
            return solver.refine(pose, material, guess.displacement, guess.pressure)
        except SolverError:
            # The material has moved too far for that; follow the motion instead.
            pass
    if last is None and before is not None:
        last = solver.refine(before.pose, material, before.displacement, before.pressure)
    return solver.solve(pose, material, last or settled(solver, material))
