"""The terms of a hypothesis as they advance along an experiment and from one experiment to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.experiment import Experiment
from estimator.fem.assembly.body import Response
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.rubbing import Rubs, carried_to
from estimator.fem.terms.term import BeginsAnew, Memoryless, Term

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class TermForces:
    """Nodal forces (n, 3), N, of all terms, and of those that rub on what holds the tissue."""

    total: FloatArray
    rubbing: FloatArray


class TermHistory:
    """What the tissue and its surroundings remember: :meth:`begin`, then :meth:`at` and :meth:`pass_by` in turn."""

    def __init__(self, hypothesis: Hypothesis) -> None:
        self._hypothesis = hypothesis
        self._terms: tuple[Term, ...] | None = None

    def begin(self, problem: RetractionProblem, experiment: Experiment) -> None:
        """Start an experiment: from the second on, what remembers goes on after a rest, and the others begin anew."""
        fresh = self._hypothesis.terms(problem, experiment)
        if self._terms is not None:
            pairs = zip(fresh, self._terms, strict=True)
            fresh = tuple(new if isinstance(new, Memoryless) else last.rested() for new, last in pairs)
        self._terms = fresh

    @classmethod
    def begun(cls, hypothesis: Hypothesis, problem: RetractionProblem, experiment: Experiment) -> TermHistory:
        """Return the history of a hypothesis at the start of its first experiment."""
        history = cls(hypothesis)
        history.begin(problem, experiment)
        return history

    @property
    def carries_over(self) -> bool:
        """Whether an experiment depends on what those before it have left."""
        return not all(isinstance(term, Memoryless | BeginsAnew) for term in self._terms or ())

    @property
    def remembers(self) -> bool:
        """Whether any term depends on what went before."""
        return not all(isinstance(term, Memoryless) for term in self._terms or ())

    @property
    def steady(self) -> bool:
        """Whether a pose that is met again is answered as before: no term remembers, none is timed."""
        return all(isinstance(term, Memoryless) and not term.timed for term in self._terms or ())

    def at(self, elapsed_s: float, pose: GripperPose) -> tuple[Term, ...]:
        """Return the terms as they stand so long after the last time_point, the gripper at a pose."""
        later = tuple(term.starting_after(elapsed_s) for term in self._terms or ())
        self._terms = carried_to(pose.position, pose.rotation, later)
        return self._terms

    def pass_by(self, displacement: FloatArray, response: Response) -> None:
        """Advance past a time_point with its displacement (n, 3)."""
        self._terms = tuple(term.after(displacement, response) for term in self._terms or ())

    def forces(
        self, elapsed_s: float, pose: GripperPose, displacement: FloatArray, response: Response
    ) -> TermForces:
        """Return the forces at the next time_point; :meth:`pass_by` advances past it."""
        total, rubbing = np.zeros_like(displacement), np.zeros_like(displacement)
        for term in self.at(elapsed_s, pose):
            forces = term.forces(displacement, response)
            total += forces
            if isinstance(term, Rubs):
                rubbing += forces
        return TermForces(total, rubbing)
