"""The tissue is stiffer along one direction in the plane."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimator.effects.effect import Amplitude, Constant, Effect, Group, Values
from estimator.experiment import Experiment
from estimator.fem.fibres import BucklingFibres, Fibres
from estimator.fem.problem import RetractionProblem
from estimator.fem.terms import Term
from estimator.materials.material import Material

# Along the fibres Young's modulus grows by four times this share.
_FIBRES = Amplitude("fibre_modulus_over_modulus", "1", scale=0.1, smallest=0.01, lower=0.0, upper=10.0)
# The direction repeats after π; the bounds let a refinement cross that seam.
_ANGLE = Constant(
    "fibre_angle", "rad", tuple(float(n * np.pi / 12) for n in range(12)), lower=-np.pi, upper=2 * np.pi
)


class Anisotropy(Effect):
    """Fibres in the plane, at ``fibre_angle`` from the x axis towards the y axis.

    Parameters
    ----------
    form : what the instance is called; empty for the usual one
    fibres : what they bear
    """

    label: ClassVar[str] = "anisotropy"
    group: ClassVar[Group] = "material"
    words: ClassVar[str] = "The tissue is stiffer along one direction in the plane."
    amplitudes = (_FIBRES,)
    constants = (_ANGLE,)

    def __init__(self, form: str, fibres: type[Fibres]) -> None:
        self.form = form
        self._fibres = fibres

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Return the fibres."""
        share = values[_FIBRES.name]
        if not share:
            return ()
        angle = values[_ANGLE.name]
        direction = np.array([np.cos(angle), np.sin(angle), 0.0])
        return (self._fibres(problem.body, share * material.youngs_modulus, direction),)


ANISOTROPY = (Anisotropy("", Fibres), Anisotropy("tension_only", BucklingFibres))
