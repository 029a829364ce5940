"""The stress relaxes while the gripper holds, and lags on the way back."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.relaxation import Relaxation, RelaxingPart
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

_TIMES_S = (2.0, 8.0, 30.0)
# Of several terms the slowest may be slower than any one that fits alone.
_TIMES_OF_SEVERAL_S = (*_TIMES_S, 120.0)
# Half the width of a band of times in ln τ: e to e³ on either side of its middle. By six terms the relaxation of the
# widest is told within 0.002 of the share that relaxes.
_BAND = Constant("half_width_of_ln_time", "1", (1.5,), lower=0.05, upper=3.5)
# From all but nothing at the fast end to all but nothing at the slow one.
_LEAN = Constant("lean", "1", (0.0,), lower=-1.0, upper=1.0)
_TERMS_OF_A_BAND = 6
_MIDDLE = Constant("relaxation_time_1", "s", (8.0,), lower=0.1, upper=1000.0)


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
        shares, times_s = self._prony(values)
        if not shares.any():
            return ()
        return (Relaxation.at_rest(problem.body, material, self._part, shares, times_s),)

    def _prony(self, values: Values) -> tuple[FloatArray, FloatArray]:
        """Return shares and times, s, of the terms."""
        shares = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        names = (f"relaxation_time_{n}" for n in range(1, len(shares) + 1))
        return shares, np.array([values[name] for name in names])


class RelaxationSpectrum(Viscoelasticity):
    """A continuous spectrum of times in place of a few: even in ln τ over a band, or more at one end of it.

    An even band is the spectrum of Fung's quasi-linear tissue; one that leans towards its slow or its fast end is that
    of a power law of time as far as an experiment lasts (Y. C. Fung, Biomechanics, 1993, section 7.6). A narrow band is
    a single time.
    """

    def __init__(self, form: str, part: RelaxingPart, elaborates: str) -> None:
        super().__init__(form, 1, part, elaborates)
        self.constants = (_MIDDLE, _BAND, _LEAN)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return one band, as wide as the times from which a search for a single one begins."""
        return [{constant.name: constant.grid[0] for constant in self.constants}]

    def _prony(self, values: Values) -> tuple[FloatArray, FloatArray]:
        (share,), (middle_s,) = super()._prony(values)
        places, weights = np.polynomial.legendre.leggauss(_TERMS_OF_A_BAND)
        leaning = 0.5 * weights * (1.0 + values[_LEAN.name] * places)
        return share * leaning, middle_s * np.exp(values[_BAND.name] * places)


# Those of the isochoric part leave pressure and volume as they are, which is usual: rubbery networks relax in shear
# (J. C. Simo, Comput. Methods Appl. Mech. Engng 60 (1987) 153). Where all of the stress relaxes, one of the isochoric
# part explains less than a drift of the sensor, so that both are looked at from the beginning.
VISCOELASTICITY = (
    Viscoelasticity("one_term", terms=1, part="isochoric"),
    Viscoelasticity("two_terms", terms=2, part="isochoric", elaborates="one_term"),
    Viscoelasticity("whole_stress", terms=1, part="whole"),
    Viscoelasticity("whole_stress_two_terms", terms=2, part="whole", elaborates="whole_stress"),
    RelaxationSpectrum("spectrum", "isochoric", elaborates="one_term"),
    RelaxationSpectrum("whole_stress_spectrum", "whole", elaborates="whole_stress"),
)
