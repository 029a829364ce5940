"""The jaws of the gripper heat the tissue, which softens near them while the gripper holds.

Heat spreads from the grasp: a point at the distance d has lost the share

    s (1 − exp(−t/τ)) exp(−d/ℓ)

of what it resists to a change of shape after the time t. Between experiments the tissue cools down.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator import Amplitude, Effect
from estimator.effects.effect import Constant, Values
from estimator.experiment import Experiment
from estimator.fem.assembly.body import AddedEnergy, Body, Response, nodal_forces
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.quadrature import quadrature_points
from estimator.fem.terms.stress_terms import isochoric_energy, isochoric_slope
from estimator.fem.terms.term import Memoryless, Term, TermStiffness
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Softened(Memoryless):
    """The isochoric stress that heated tissue no longer bears, taken from that of the cold one.

    Attributes
    ----------
    body, material : of the tissue, cold
    lost : (e, q) share that is lost in the end
    warming_s : τ
    elapsed_s : since the gripper took hold
    """

    timed: ClassVar[bool] = True

    body: Body
    material: Material
    lost: FloatArray
    warming_s: float
    elapsed_s: float = 0.0

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the nodal forces (n, 3), N."""
        return nodal_forces(self.body, response, -self._present * isochoric_slope(self.material, response))

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the derivative of :meth:`forces`."""
        energy = isochoric_energy(self.material, response)
        share = -self._present
        return TermStiffness(energy=AddedEnergy(share * energy.slope, share * energy.curvature))

    def starting_after(self, seconds: float) -> Softened:
        """Return the term once the tissue was heated for some time more."""
        return replace(self, elapsed_s=self.elapsed_s + seconds)

    @property
    def _present(self) -> FloatArray:
        return np.asarray(-np.expm1(-self.elapsed_s / self.warming_s) * self.lost)


class HeatedJaws(Effect):
    """Softening near the grasp that grows with time."""

    label = "heated_jaws"
    group = "grasp"
    stage = "mounting"
    acts_on = ("terms",)
    rate_dependent = True
    measured_by = "lay a thermocouple between the jaws"
    words = "The jaws heat the tissue, which softens near them."
    amplitudes = (Amplitude("softening", "1", scale=0.3, smallest=0.03, lower=0.0, upper=0.9),)
    constants = (
        Constant("warming_time", "s", (5.0, 20.0), lower=1.0, upper=300.0),
        Constant("depth", "m", (0.008,), lower=0.002, upper=0.03),
    )

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Soften the tissue around the grasp."""
        if not values["softening"]:
            return ()
        distance = experiment.grasp.box.distance(quadrature_points(problem.body.mesh))
        lost = values["softening"] * np.exp(-distance / values["depth"])
        return (Softened(problem.body, material, lost, values["warming_time"]),)
