"""The anchored face gives elastically: glue, foam under a clamp, a frame that bends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.stages import Hook, Stage
from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.fem.boundary.anchorage import anchored_areas, rim_of, set_free
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.steady import NodalSprings
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# An anchor that is stiff in one direction alone gives less than a sensor sees in the other, and the tangent of
# the springs stays well conditioned, m.
_STIFFEST_M = 1e-6
# A search begins with either end of the rim the soft one.
_UNEVENNESS = (-0.4, 0.4)
# A node is held by each anchor that is no farther from it than the nearest, up to this.
_SAME_DISTANCE_M = 1e-6


class AnchorCompliance(Effect):
    """Springs in place of a rigid anchor, over the whole anchored area.

    Amplitudes are lengths of tissue that would stretch as much under the same traction, compliance times E: unlike a
    compliance in m³/N they leave the deformation as it is when the tissue's modulus changes.
    """

    label: ClassVar[str] = "anchor_compliance"
    group: ClassVar[Group] = "anchor"
    stage: ClassVar[Stage] = "mounting"
    acts_on: ClassVar[tuple[Hook, ...]] = ("problem", "terms")
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
        per_length = (
            problem.attachment * material.youngs_modulus * self._evenness(problem, experiment, values)
        )
        area, normals = anchored_areas(problem)
        springs = normals / max(normal, _STIFFEST_M)
        springs += (area[:, None, None] * np.eye(3) - normals) / max(tangential, _STIFFEST_M)
        return (NodalSprings(per_length[:, None, None] * springs),)

    def _evenness(self, problem: RetractionProblem, experiment: Experiment, values: Values) -> FloatArray:
        """Return the factor (n,) on the springs of each node."""
        return np.ones(len(problem.attachment))


def _unevenness(name: str) -> Constant:
    return Constant(name, "1", _UNEVENNESS, lower=-0.95, upper=0.95)


class UnevenAnchorCompliance(AnchorCompliance):
    """Springs that give differently along the face and across it.

    They soften from one end of the anchored rim to the other, by the factors 1 + k to 1 - k of their mean.
    """

    constants: tuple[Constant, ...] = (_unevenness("unevenness"),)

    def _evenness(self, problem: RetractionProblem, experiment: Experiment, values: Values) -> FloatArray:
        return _falling(values["unevenness"], rim_of(problem).place)


class EachAnchorUneven(UnevenAnchorCompliance):
    """The same for two anchors, each of which softens from one end of its own rim to the other.

    Raises
    ------
    InputError
        The phantom has one anchor, or more than two.
    """

    constants = (_unevenness("unevenness_1"), _unevenness("unevenness_2"))

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return those of the grid where there are two anchors."""
        two = all(len(each.experiment.anchors) == len(self.constants) for each in baseline)
        return super().starts(baseline) if two else []

    def _evenness(self, problem: RetractionProblem, experiment: Experiment, values: Values) -> FloatArray:
        if len(experiment.anchors) != len(self.constants):
            raise InputError(
                f"{self.name}: is for two anchors and the phantom has {len(experiment.anchors)}; take "
                f"{self.label}:uneven"
            )
        place = rim_of(problem).place
        away = np.array([anchor.distance(problem.body.mesh.points) for anchor in experiment.anchors])
        nearest = problem.anchored & (away < away.min(axis=0) + _SAME_DISTANCE_M)
        factor = np.ones(nearest.shape)
        for constant, own, held in zip(self.constants, factor, nearest, strict=True):
            way = place[held] - place[held].min()
            own[held] = _falling(values[constant.name], way / max(way.max(), np.finfo(float).tiny))
        # Where both hold a node, at a corner, it has the mean of the two.
        return np.asarray(np.average(factor, axis=0, weights=np.where(problem.anchored, nearest, 1.0)))


def _falling(unevenness: float, share: FloatArray) -> FloatArray:
    """Return the factor on the springs at shares (n,) of the way along a rim."""
    return 1.0 - unevenness * (2.0 * share - 1.0)


def _lengths(values: Values) -> tuple[float, float]:
    if "length" in values:
        return values["length"], values["length"]
    return values["normal_length"], values["tangential_length"]


def _length(name: str) -> Amplitude:
    return Amplitude(name, "m", scale=4e-3, smallest=2e-4, lower=0.0, upper=0.1)


_BY_DIRECTION = _length("normal_length"), _length("tangential_length")

ANCHOR_COMPLIANCE = (
    AnchorCompliance("isotropic", _length("length")),
    UnevenAnchorCompliance("uneven", *_BY_DIRECTION),
    EachAnchorUneven("each_uneven", *_BY_DIRECTION),
)
