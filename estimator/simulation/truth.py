"""What is true of a simulated phantom: its material, whatever its law, and the effects that act on it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.effects.catalogue import default_catalogue
from estimator.effects.stages import STAGES
from estimator.materials import NEO_HOOKEAN
from estimator.materials.material import Material
from estimator.simulation.acting import ActingEffect


@dataclass(frozen=True)
class Truth(Hypothesis):
    """A hypothesis whose tissue may follow another law than the baseline's."""

    tissue: Material = field(default=NEO_HOOKEAN)

    def material(self) -> Material:
        """Return the tissue's law with all effects on it."""
        material = self.tissue
        for effect, values in zip(self.effects, self.values, strict=True):
            material = effect.material(material, values)
        return material

    def weakened(self, share: float) -> "Truth":
        """Return the truth with every amplitude multiplied by a share."""
        values = tuple(
            {**given, **{a.name: share * given[a.name] for a in effect.amplitudes}}
            for effect, given in zip(self.effects, self.values, strict=True)
        )
        return replace(self, values=values)


def truth_of(material: Material, acting: Sequence[ActingEffect]) -> Truth:
    """Return what is true where these effects act on that material.

    They act in the order of the default catalogue; what it does not hold acts last of its stage.
    """
    place = {effect.name: number for number, effect in enumerate(default_catalogue().effects)}
    ordered = sorted(
        acting,
        key=lambda one: (STAGES.index(one.effect.stage), place.get(one.effect.name, len(place))),
    )
    return Truth(
        material.youngs_modulus,
        material.poisson_ratio,
        tuple(one.effect for one in ordered),
        tuple(one.values for one in ordered),
        tissue=material,
    )
