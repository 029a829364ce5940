"""The stress grows faster with strain than the Neo-Hookean law's."""

from __future__ import annotations

from typing import ClassVar

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Effect, Hook, Stage, Values
from estimator.materials import law_named
from estimator.materials.material import Material
from estimator.materials.superposed import departing


class StrainStiffening(Effect):
    """A hyperelastic law that stiffens.

    Parameters
    ----------
    law : name of a law of :mod:`estimator.materials`; its first shape parameter is the amplitude, any other stays at
        its null
    scale : of the amplitude; 10 % more force at 20 % stretch is usual
    smallest : that matters; 1 % more
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

    def __init__(self, law: str, scale: float, smallest: float) -> None:
        self.form = law
        self._law = law_named(law)
        parameter = self._law.shape_parameters[0]
        lower, upper = parameter.null, parameter.upper
        self.amplitudes = (Amplitude(parameter.name, "1", scale, smallest, lower, upper),)

    def material(self, material: Material, values: Values) -> Material:
        """Return the material with the law's departure added."""
        amount = values[self.amplitudes[0].name]
        return departing(material, self._law, (amount,)) if amount else material


# At a stretch of 1.2 at constant volume x = 0.107: each scale makes dw/dx 1.1 times what it is at rest, but that of
# the eight chains, whose range ends before.
STRAIN_STIFFENING = (
    StrainStiffening("yeoh2", scale=0.47, smallest=0.047),
    StrainStiffening("gent", scale=0.85, smallest=0.085),
    StrainStiffening("veronda_westmann", scale=0.9, smallest=0.09),
    StrainStiffening("arruda_boyce", scale=0.5, smallest=0.15),
)
