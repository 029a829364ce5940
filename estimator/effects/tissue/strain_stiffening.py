"""The stress grows faster with strain than the Neo-Hookean law's."""

from __future__ import annotations

from typing import ClassVar

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Values
from estimator.effects.stages import Hook, Stage
from estimator.materials import ArrudaBoyce, Gent, Knowles, Law, Ogden1, VerondaWestmann, Yeoh
from estimator.materials.material import Material
from estimator.materials.superposed import departing


class StrainStiffening(Effect):
    """A hyperelastic law that stiffens.

    Parameters
    ----------
    law : of which it is the departure from the Neo-Hookean one; its name is that of the form
    amplitudes : how far its first shape parameters are beyond their null
    constants : of as many that follow, which have no null; what is left stays at its own
    elaborates : form of which this one is a refinement; empty for none
    """

    label: ClassVar[str] = "strain_stiffening"
    group: ClassVar[Group] = "material"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("material",)
    words: ClassVar[str] = "The stress grows faster with strain than the Neo-Hookean law's."

    laws: ClassVar[tuple[str, ...]] = (
        "yeoh2",
        "yeoh3",
        "gent",
        "arruda_boyce",
        "veronda_westmann",
        "ogden1",
        "ogden2",
        "st_venant_kirchhoff",
    )

    def __init__(
        self,
        law: Law,
        *amplitudes: Amplitude,
        constants: tuple[Constant, ...] = (),
        elaborates: str = "",
    ) -> None:
        self.form = law.name
        self.amplitudes = amplitudes
        self.constants = constants
        self.elaborates = elaborates
        self._law = law

    def material(self, material: Material, values: Values) -> Material:
        """Return the material with the law's departure added."""
        amounts = [values[amplitude.name] for amplitude in self.amplitudes]
        if not any(amounts):
            return material
        first = self._law.shape_parameters[: len(amounts)]
        shape = [parameter.null + amount for parameter, amount in zip(first, amounts, strict=True)]
        return departing(material, self._law, (*shape, *(values[one.name] for one in self.constants)))


# Of Knowles: from beyond Gent's limit over an exponential to a straight line, and to one that bends down.
_COURSE = Constant("course", "1", (-1.0, 1.0), lower=-3.0, upper=2.0)

# At a stretch of 1.2 at constant volume x = 0.107: each scale makes dw/dx 1.1 times what it is at rest, but that of
# the eight chains, whose range ends before, and of Ogden's exponent, of which 10 % more force at this stretch is usual.
STRAIN_STIFFENING = (
    StrainStiffening(Yeoh(2), Amplitude("c2", "1", scale=0.47, smallest=0.047, lower=0.0, upper=10.0)),
    StrainStiffening(
        Gent(), Amplitude("inverse_limit", "1", scale=0.85, smallest=0.085, lower=0.0, upper=5.0)
    ),
    StrainStiffening(
        VerondaWestmann(), Amplitude("exponent", "1", scale=0.9, smallest=0.09, lower=0.0, upper=50.0)
    ),
    StrainStiffening(
        ArrudaBoyce(),
        Amplitude("inverse_locking_stretch_squared", "1", scale=0.5, smallest=0.15, lower=0.0, upper=1.0),
    ),
    StrainStiffening(
        Knowles(),
        Amplitude("rate", "1", scale=0.9, smallest=0.09, lower=0.0, upper=10.0),
        constants=(_COURSE,),
        elaborates="yeoh2",
    ),
    StrainStiffening(
        Yeoh(3),
        Amplitude("c2", "1", scale=0.47, smallest=0.047, lower=-0.5, upper=10.0),
        Amplitude("c3", "1", scale=2.9, smallest=0.29, lower=-0.5, upper=10.0),
        elaborates="yeoh2",
    ),
    StrainStiffening(
        Ogden1(),
        Amplitude("exponent_beyond_two", "1", scale=1.5, smallest=0.15, lower=0.0, upper=18.0),
        elaborates="yeoh2",
    ),
)
