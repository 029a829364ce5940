"""The tissue sticks to a patch of the table below it: no label of the catalogue."""

from __future__ import annotations

import numpy as np

from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Values
from estimator.effects.shared.on_table import OnTable, area_within
from estimator.effects.shared.places import CENTRE
from estimator.effects.tissue.inhomogeneity import Inhomogeneity
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.steady import NodalSprings
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

_STIFFNESS = Amplitude("stiffness_over_modulus", "1/m", scale=100.0, smallest=2.0, lower=0.0, upper=1e5)
_RADIUS = Constant("radius", "m", (0.01,), lower=0.003, upper=0.04)


class StickyPatch(OnTable):
    """Springs hold the underside within a circle to where it was at rest: per area, stiffness times Young's modulus.

    A film of glue or water of height h and modulus E' holds with E' / h per area.
    """

    label = OUTSIDE
    group = "environment"
    stage = "surroundings"
    acts_on = ("terms",)
    words = "The tissue sticks to a patch of the table below it."
    form = "sticky_patch"
    mistaken_for = (Inhomogeneity.label,)
    amplitudes = (_STIFFNESS,)
    constants = (*CENTRE, _RADIUS)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Hold the nodes of the underside within the patch."""
        if not values[_STIFFNESS.name]:
            return ()
        stiffness = values[_STIFFNESS.name] * material.youngs_modulus * area_within(problem, values)
        return (NodalSprings(stiffness[:, None, None] * np.eye(3)),)
