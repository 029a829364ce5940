"""The stress relaxes while the gripper holds, and lags on the way back."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Hook, Readings, Stage, Values
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.relaxation import Relaxation, RelaxingPart
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

_TIMES_S = (2.0, 8.0, 30.0)
# Of several terms the slowest may be slower than any one that fits alone.
_TIMES_OF_SEVERAL_S = (*_TIMES_S, 120.0)


class Viscoelasticity(Effect):
    """Prony terms beyond the long-term stress, to which Young's modulus belongs.

    The amplitudes count in units of that stress: where a share f of a sudden stress relaxes, they sum to f / (1 − f).

    Parameters
    ----------
    form : what the instance is called
    terms : how many; each has a share of the long-term stress and a time
    part : what relaxes
    elaborates : form of which this one is a refinement; empty for none
    """

    label: ClassVar[str] = "viscoelasticity"
    group: ClassVar[Group] = "material"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("terms",)
    words: ClassVar[str] = (
        "The stress relaxes while the gripper holds and lags on the way back; E is that of the stress that stays."
    )
    rate_dependent: ClassVar[bool] = True
    terms_alike: ClassVar[bool] = True

    def __init__(self, form: str, terms: int, part: RelaxingPart, elaborates: str = "") -> None:
        self.form = form
        self._part = part
        self.elaborates = elaborates
        numbers = range(1, terms + 1)
        self.amplitudes = tuple(
            Amplitude(f"relaxing_share_{n}", "1", scale=0.4 / terms, smallest=0.02, lower=0.0, upper=5.0)
            for n in numbers
        )
        self._times_s = _TIMES_S if terms == 1 else _TIMES_OF_SEVERAL_S
        self.constants = tuple(
            Constant(f"relaxation_time_{n}", "s", self._times_s, lower=0.1, upper=1000.0) for n in numbers
        )

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return every ascending choice of times from the grid: the order of the terms means nothing."""
        names = [constant.name for constant in self.constants]
        chosen = itertools.combinations(self._times_s, len(names))
        return [dict(zip(names, times, strict=True)) for times in chosen]

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Return the relaxing stress."""
        shares = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        if not shares.any():
            return ()
        times_s = np.array([values[constant.name] for constant in self.constants])
        return (Relaxation.at_rest(problem.body, material, self._part, shares, times_s),)


# Those of the isochoric part leave pressure and volume as they are, which is usual: rubbery networks relax in shear
# (J. C. Simo, Comput. Methods Appl. Mech. Engng 60 (1987) 153). Where all of the stress relaxes, one of the isochoric
# part explains less than a drift of the sensor, so that both are looked at from the beginning.
VISCOELASTICITY = (
    Viscoelasticity("one_term", terms=1, part="isochoric"),
    Viscoelasticity("two_terms", terms=2, part="isochoric", elaborates="one_term"),
    Viscoelasticity("whole_stress", terms=1, part="whole"),
    Viscoelasticity("whole_stress_two_terms", terms=2, part="whole", elaborates="whole_stress"),
)
