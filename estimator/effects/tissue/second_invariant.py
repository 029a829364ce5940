"""A share of the energy depends on the second invariant."""

from __future__ import annotations

from typing import ClassVar

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Effect, Values
from estimator.effects.stages import Hook, Stage
from estimator.materials import IsochoricMooneyRivlin, Law, MooneyRivlin
from estimator.materials.material import Material
from estimator.materials.superposed import departing

_SHARE = Amplitude("share", "1", scale=0.3, smallest=0.05, lower=0.0, upper=1.0)


class SecondInvariant(Effect):
    """The Mooney-Rivlin law; the amplitude is m = C01 / (C10 + C01).

    Parameters
    ----------
    form : what the instance is called
    law : how it is carried over to tissue that changes its volume
    """

    label: ClassVar[str] = "second_invariant"
    group: ClassVar[Group] = "material"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("material",)
    words: ClassVar[str] = "A share of the tissue's energy depends on the second invariant (Mooney-Rivlin)."
    laws: ClassVar[tuple[str, ...]] = (MooneyRivlin.name, IsochoricMooneyRivlin.name)
    amplitudes = (_SHARE,)

    def __init__(self, form: str, law: Law) -> None:
        self.form = form
        self._law = law

    def material(self, material: Material, values: Values) -> Material:
        """Return the material with that share of its energy moved to the second invariant."""
        share = values[_SHARE.name]
        return departing(material, self._law, (share,)) if share else material


SECOND_INVARIANT = (
    SecondInvariant("modified", MooneyRivlin()),
    SecondInvariant("isochoric", IsochoricMooneyRivlin()),
)
