"""Solved states that are kept, and the guesses of other states that are made of them."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.newton import NewtonSettings
from estimator.fem.equilibrium.observation import Observation, at_modulus
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# A rotation counts as the motion that it gives a point at this distance from the gripper frame's origin, m.
_LEVER_M = 0.01
# A pose farther from the way between two others than this share of it is not between them.
_FARTHEST = 0.5


@dataclass(frozen=True)
class Guess:
    """Where an equilibrium is looked for.

    Attributes
    ----------
    displacement : (n, 3), m; gripped nodes are yet to be set to the pose
    pressure : (e, q) λ·(projected dilatation), Pa
    """

    displacement: FloatArray
    pressure: FloatArray


@dataclass(frozen=True)
class Solution:
    """A solved state without its factor, so that as many can be kept as an experiment has.

    Attributes
    ----------
    pose : of the gripper
    material : that it was solved for
    newton : how exactly it was solved
    displacement, pressure : as in :class:`Guess`
    by_pose : (nf, 6) derivative of the free displacements by the gripper's translation (m) and rotation (rad)
    observation : what the sensors see of it
    """

    pose: GripperPose
    material: Material
    newton: NewtonSettings
    displacement: FloatArray
    pressure: FloatArray
    by_pose: FloatArray
    observation: Observation

    @staticmethod
    def of(state: EquilibriumState, newton: NewtonSettings, observation: Observation) -> "Solution":
        """Return what is kept of a state."""
        pressure = state.response.pressure
        return Solution(
            state.pose, state.material, newton, state.displacement, pressure, state.by_pose, observation
        )

    def is_of(self, material: Material) -> bool:
        """Tell whether it was solved for this material."""
        return self.material.youngs_modulus == material.youngs_modulus and self.scales_to(material)

    def scales_to(self, material: Material) -> bool:
        """Tell whether a material differs from its own in Young's modulus at most."""
        same = self.material.poisson_ratio == material.poisson_ratio
        return same and bool(np.array_equal(self.material.shape, material.shape))

    def at_modulus(self, material: Material) -> "Solution":
        """Return it for a material that differs in Young's modulus alone, to which all forces are proportional."""
        before, after = self.material.youngs_modulus, material.youngs_modulus
        return replace(
            self,
            material=material,
            pressure=self.pressure * (after / before),
            observation=at_modulus(self.observation, before, after),
        )


def carried_over(problem: RetractionProblem, known: Solution, material: Material) -> Guess:
    """Extrapolate a solution to another material of the same law.

    The field follows −ln(1 − 2ν), in which it is nearly linear, and the shape parameters; Young's modulus multiplies
    the pressure, and by its inverse goes what weight does to the field.
    """
    old, new = known.material.poisson_ratio, material.poisson_ratio
    before, after = known.material.youngs_modulus, material.youngs_modulus
    change = {
        "poisson_ratio": 0.5 * (1 - 2 * old) * math.log((1 - 2 * old) / (1 - 2 * new)),
        "youngs_modulus": before / after * (after - before) if problem.heavy else 0.0,
    }
    for n, parameter in enumerate(material.law.shape_parameters):
        change[parameter.name] = float(material.shape[n] - known.material.shape[n])
    guess = known.displacement.copy().reshape(-1)
    for name, amount in change.items():
        guess[problem.pattern.free] += amount * known.observation.field_by[name]
    pressure = known.pressure * (after / before)
    return Guess(guess.reshape(known.displacement.shape), pressure)


def between(problem: RetractionProblem, before: Solution, after: Solution, pose: GripperPose) -> Guess | None:
    """Interpolate two solutions of one material at a pose on the way between theirs; None where it lies elsewhere.

    Along the way the field follows the cubic that agrees with both and their derivatives (Hermite), beside it those
    derivatives; the pressure is interpolated linearly.
    """
    way, done = before.pose.increment_to(after.pose), before.pose.increment_to(pose)
    lever = np.array([1.0, 1.0, 1.0, _LEVER_M, _LEVER_M, _LEVER_M])
    length = float(np.linalg.norm(lever * way))
    share = float((lever * done) @ (lever * way)) / max(length**2, np.finfo(float).tiny)
    aside = done - share * way
    if not 0.0 <= share <= 1.0 or float(np.linalg.norm(lever * aside)) > _FARTHEST * length:
        return None
    guess = before.displacement.copy().reshape(-1)
    free = problem.pattern.free
    change = after.displacement.reshape(-1)[free] - guess[free]
    at_start, at_end = before.by_pose @ way, after.by_pose @ way
    left = 1.0 - share
    guess[free] += share**2 * (3.0 - 2.0 * share) * change
    guess[free] += share * left * (left * at_start - share * at_end)
    guess[free] += left * (before.by_pose @ aside) + share * (after.by_pose @ aside)
    return Guess(guess.reshape(before.displacement.shape), left * before.pressure + share * after.pressure)
