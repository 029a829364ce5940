"""The phantom is thicker or thinner than stated."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from estimator.effects.blocks import Group
from estimator.effects.effect import HARDLY_INEXACT, Amplitude, Effect, Values
from estimator.effects.stages import Hook, Stage
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.morph import with_points

_EXCESS = Amplitude("excess", "1", scale=0.08, smallest=5e-3, lower=-0.5, upper=0.8)


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
    amplitudes = (_EXCESS,)

    def __init__(
        self, form: str, about: Literal["middle", "table"], beads: Literal["measured", "drawn"]
    ) -> None:
        self.form = form
        self._about = about
        self._beads = beads

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Scale the rest positions."""
        excess = values["excess"]
        if not excess:
            return problem
        points = problem.body.mesh.points
        still = points[:, 2].min() if self._about == "table" else 0.0
        stretch = np.array([0.0, 0.0, excess])
        scaled = with_points(problem, points + stretch * (points[:, 2:] - still))
        carried = stretch * (problem.fiducials_rest[:, 2:] - still)
        if self._beads == "measured":
            return replace(scaled, fiducials_off=carried)
        return replace(scaled, fiducials_rest=problem.fiducials_rest + carried)


THICKNESS_ERROR = (
    ThicknessError("about_middle", "middle", "measured"),
    ThicknessError("about_middle_beads_drawn", "middle", "drawn"),
    ThicknessError("on_table_beads_drawn", "table", "drawn"),
)
