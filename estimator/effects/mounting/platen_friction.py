"""The tissue slides on the plates between which it is pressed, as far as friction lets it."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Values
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.boundary.friction_on_platens import RubbingOnPlatens
from estimator.fem.boundary.platens import Platens, held_along_normal, platens_of
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

BoolArray = NDArray[np.bool_]


class PlatenFriction(Effect):
    """Plates that hold the tissue by their push and by friction, not by a bond.

    The amplitude is the inverse of Coulomb's coefficient: 0 is a bonded face, and a large one a lubricated. What sticks
    gives a little before it slides: at a coefficient of one as much as a length ``give`` of tissue would give under the
    same traction, at a larger one less, and a bonded face not at all.
    """

    label: ClassVar[str] = "platen_friction"
    group: ClassVar[Group] = "grasp"
    stage: ClassVar[Stage] = "mounting"
    acts_on: ClassVar[tuple[Hook, ...]] = ("problem", "terms")
    words: ClassVar[str] = "The tissue slides on the plates that press it."
    measured_by: ClassVar[str] = (
        "press once more with the plates lubricated, and once with the tissue glued to them"
    )
    keeps_pattern: ClassVar[bool] = False
    needs_platens: ClassVar[bool] = True
    at_thresholds: ClassVar[bool] = True
    amplitudes = (Amplitude("slipperiness", "1", scale=2.0, smallest=0.2, lower=0.0, upper=100.0),)
    constants = (Constant("give", "m", (1e-3,), lower=1e-4, upper=1e-2),)

    def __init__(self, form: str, *, standing: bool, moving: bool) -> None:
        self.form = form
        self._standing, self._moving = standing, moving

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Hold the faces along the plates' normal alone."""
        platens = platens_of(problem)
        if not values["slipperiness"] or platens is None:
            return problem
        return held_along_normal(problem, platens, self._sliding(platens))

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Let the faces rub on the plates."""
        platens = platens_of(problem)
        if not values["slipperiness"] or platens is None:
            return ()
        spring = material.youngs_modulus / (values["slipperiness"] * values["give"]) * platens.area
        held = problem.gripped if problem.pressed is None else problem.gripped | problem.pressed.any(axis=1)
        sliding = self._sliding(platens) & held
        return (
            RubbingOnPlatens.at_rest(
                problem.body, platens, np.where(sliding, spring, 0.0), 1.0 / values["slipperiness"]
            ),
        )

    def _sliding(self, platens: Platens) -> BoolArray:
        return (platens.standing & self._standing) | (platens.moving & self._moving)


PLATEN_FRICTION = (
    PlatenFriction("both", standing=True, moving=True),
    PlatenFriction("moving_plate", standing=False, moving=True),
    PlatenFriction("standing_plate", standing=True, moving=False),
)
