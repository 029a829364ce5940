"""The phantom is thicker or thinner than stated."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Values
from estimator.effects.stages import Hook, Stage
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.morph import with_points

FloatArray = NDArray[np.float64]

_EXCESS = Amplitude("excess", "1", scale=0.08, smallest=5e-3, lower=-0.5, upper=0.8)


def _sloping(axis: str) -> Amplitude:
    return Amplitude(f"excess_at_{axis}_edge", "1", scale=0.08, smallest=5e-3, lower=-0.3, upper=0.3)


_SLOPES = _sloping("x"), _sloping("y")
_CROWN = Amplitude("excess_in_middle", "1", scale=0.08, smallest=5e-3, lower=-0.4, upper=0.6)


class ThicknessError(Effect):
    """The phantom is scaled in z, about its middle or about the table below it.

    Beads keep their place on the tissue. Their rest positions are those stated: where a camera measured them, that
    is where they are; where a drawing told their height, the top face has carried them off and ``beads`` is "drawn".
    """

    label: ClassVar[str] = "thickness_error"
    group: ClassVar[Group] = "geometry"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("problem",)
    measured_by: ClassVar[str] = "measure the phantom's thickness with a calliper"
    words: ClassVar[str] = "The phantom is thicker or thinner than stated."
    inexactness: ClassVar[float] = HARDLY_INEXACT
    amplitudes: tuple[Amplitude, ...] = (_EXCESS,)

    def __init__(
        self, form: str, about: Literal["middle", "table"], beads: Literal["measured", "drawn"]
    ) -> None:
        self.form = form
        self._about = about
        self._beads = beads

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Scale the rest positions."""
        if not any(values[amplitude.name] for amplitude in self.amplitudes):
            return problem
        points = problem.body.mesh.points
        still = points[:, 2].min() if self._about == "table" else 0.0

        def raised(places: FloatArray) -> FloatArray:
            raised_m = np.zeros_like(places)
            raised_m[:, 2] = self._excess(problem, places, values) * (places[:, 2] - still)
            return raised_m

        scaled = with_points(problem, points + raised(points))
        carried = raised(problem.fiducials_rest)
        if self._beads == "measured":
            return replace(scaled, fiducials_off=carried)
        return replace(scaled, fiducials_rest=problem.fiducials_rest + carried)

    def _excess(self, problem: RetractionProblem, places: FloatArray, values: Values) -> FloatArray:
        """Return by what share (n,) of the stated thickness it is thicker at places (n, 3), m."""
        return np.full(len(places), values[_EXCESS.name])


class UnevenThicknessError(ThicknessError):
    """The phantom is thicker at one edge than at the other, or in its middle than at its edges.

    With ξ and η from −1 at one edge of the phantom to 1 at the other, along x and y (where all of an end is gripped,
    the jaws are that edge), the thickness is the stated one by 1 + a ξ + b η + c (1 − ξ²)(1 − η²): a wedge along either
    axis, as of a mould that was not level, and a crown or, where c is negative, a hollow, as of a mould that bulged or
    of a surface that rose at the walls.
    """

    amplitudes = (*_SLOPES, _CROWN)

    def _excess(self, problem: RetractionProblem, places: FloatArray, values: Values) -> FloatArray:
        nodes = problem.body.mesh.points[:, :2]
        middle, half = (nodes.max(axis=0) + nodes.min(axis=0)) / 2, np.ptp(nodes, axis=0) / 2
        share = (places[:, :2] - middle) / half
        slopes = np.array([values[slope.name] for slope in _SLOPES])
        return np.asarray(share @ slopes + values[_CROWN.name] * np.prod(1.0 - share**2, axis=1))


THICKNESS_ERROR = (
    ThicknessError("about_middle", "middle", "measured"),
    ThicknessError("about_middle_beads_drawn", "middle", "drawn"),
    ThicknessError("on_table_beads_drawn", "table", "drawn"),
    UnevenThicknessError("uneven", "middle", "measured"),
)
