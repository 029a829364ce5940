"""The anchored face gives elastically: glue, foam under a clamp, a frame that bends."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Constant, Effect, Group, Values
from estimator.experiment import Experiment
from estimator.fem.anchorage import anchored_areas, set_free, share_of_rim
from estimator.fem.problem import RetractionProblem
from estimator.fem.steady import NodalSprings
from estimator.fem.terms import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# An anchor that is stiff in one direction alone gives less than a sensor sees in the other, and the tangent of
# the springs stays well conditioned, m.
_STIFFEST_M = 1e-6


class AnchorCompliance(Effect):
    """Springs in place of a rigid anchor, over the whole anchored area.

    Amplitudes are lengths of tissue that would stretch as much under the same traction, compliance times E: unlike a
    compliance in m³/N they leave the deformation as it is when the tissue's modulus changes.
    """

    label: ClassVar[str] = "anchor_compliance"
    group: ClassVar[Group] = "anchor"
    words: ClassVar[str] = "The anchored face gives elastically."
    keeps_pattern: ClassVar[bool] = False

    def __init__(self, form: str, *amplitudes: Amplitude) -> None:
        self.form = form
        self.amplitudes = amplitudes
        self.elaborates = "" if form == "isotropic" else "isotropic"

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Set the anchored nodes free."""
        if not any(_lengths(values)):
            return problem
        return set_free(problem, problem.anchored)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Hold the anchored face by springs."""
        normal, tangential = _lengths(values)
        if not (normal or tangential):
            return ()
        per_length = problem.attachment * material.youngs_modulus * self._evenness(problem, values)
        area, normals = anchored_areas(problem)
        springs = normals / max(normal, _STIFFEST_M)
        springs += (area[:, None, None] * np.eye(3) - normals) / max(tangential, _STIFFEST_M)
        return (NodalSprings(per_length[:, None, None] * springs),)

    def _evenness(self, problem: RetractionProblem, values: Values) -> FloatArray:
        """Return the factor (n,) on the springs of each node."""
        return np.ones(len(problem.attachment))


class UnevenAnchorCompliance(AnchorCompliance):
    """Springs that give differently along the face and across it.

    They soften from one end of the anchored rim to the other, by the factors 1 + k to 1 - k of their mean.
    """

    constants = (Constant("unevenness", "1", (0.3,), lower=-0.95, upper=0.95),)

    def _evenness(self, problem: RetractionProblem, values: Values) -> FloatArray:
        return 1.0 - values["unevenness"] * (2.0 * share_of_rim(problem) - 1.0)


def _lengths(values: Values) -> tuple[float, float]:
    if "length" in values:
        return values["length"], values["length"]
    return values["normal_length"], values["tangential_length"]


def _length(name: str) -> Amplitude:
    return Amplitude(name, "m", scale=4e-3, smallest=2e-4, lower=0.0, upper=0.1)


ANCHOR_COMPLIANCE = (
    AnchorCompliance("isotropic", _length("length")),
    UnevenAnchorCompliance("uneven", _length("normal_length"), _length("tangential_length")),
)
