"""A candidate cause of a published gap: an effect of the catalogue over a range of sizes, or a factor on the bench."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from estimator.effects.catalogue import default_catalogue
from estimator.studies.published_gap.retractions import Anchoring, SetUp
from estimator.studies.published_gap.simulated import REFERENCE_PA, USUAL_RATIO, SimulatedMounting, written

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Size:
    """One size of a candidate.

    Attributes
    ----------
    name, unit : of the effect's parameter; SI
    nodes : sizes at the reference modulus that are simulated beside zero, ascending
    deviation : of its prior, in its own unit; unused where ``between`` is given
    grows_with : power of E by which it is larger at the reference modulus in softer tissue's stead: 1 of a compliance,
        −1 of a force, 0 of what has no stiffness
    at_reference_alone : whether its prior is that of what does the same at the reference modulus, in whatever tissue
    one_sided : whether it has a positive sign alone
    between : of a threshold, at whose zero no effect vanishes: the ends of its prior, even in its logarithm
    """

    name: str
    unit: str
    nodes: tuple[float, ...]
    deviation: float
    grows_with: int = 0
    one_sided: bool = True
    between: tuple[float, float] | None = None
    at_reference_alone: bool = False

    def of_quantile(self, share: FloatArray) -> FloatArray:
        """Return sizes at shares (...,) of the prior's probability."""
        if self.between is not None:
            low, high = self.between
            return np.asarray(low * (high / low) ** share)
        if self.one_sided:
            return np.asarray(self.deviation * ndtri(0.5 + 0.5 * share))
        return np.asarray(self.deviation * ndtri(share))

    def at_reference(self, size: FloatArray, modulus: FloatArray) -> FloatArray:
        """Return the size at the reference modulus that does the same as ``size`` in tissue of ``modulus``, Pa."""
        scaled = size * (modulus / REFERENCE_PA) ** self._prior_grows_with
        lower = self.nodes[0] if self.between is not None else min(0.0, self.nodes[0])
        return np.clip(scaled, lower, self.nodes[-1])

    def in_tissue(self, at_reference: FloatArray, modulus: float) -> FloatArray:
        """Return the size in tissue of a modulus, Pa, that does what another does at the reference modulus."""
        return np.asarray(at_reference * (modulus / REFERENCE_PA) ** -self._prior_grows_with)

    @property
    def _prior_grows_with(self) -> int:
        return 0 if self.at_reference_alone else self.grows_with


@dataclass(frozen=True, eq=False)
class Candidate:
    """A cause that may have acted on the retractions, or on the bench test they are held against.

    Attributes
    ----------
    words : a line of a report
    effect : of the catalogue; empty where it acts on the bench test alone
    sizes : one or two; the others of the effect's parameters are ``constants``
    conditioned : whether the phantom had been drawn farther before
    on_bench : how log E of the tissue lies off the bench test's by its size: none, all materials alike, each by itself,
        or as much as the size lets relax
    direct_check : what measurement beside the retraction tells it
    checks : sizes at the reference modulus that the learnt map is checked at
    called : its own short name, where it is not the only one of its effect's label
    poisson_ratio : of the tissue that it is simulated in; what it changes is taken over to nearly incompressible tissue
    """

    words: str
    effect: str = ""
    sizes: tuple[Size, ...] = ()
    constants: Mapping[str, float] = field(default_factory=dict)
    conditioned: bool = False
    on_bench: str = "none"
    direct_check: str = ""
    checks: tuple[tuple[float, ...], ...] = ()
    poisson_ratio: float = USUAL_RATIO
    called: str = ""

    @property
    def name(self) -> str:
        """What it is called: by its own name, or by its effect's label."""
        return self.called or self.effect.partition(":")[0]

    @property
    def place(self) -> str:
        """Where it sits, in words: how the phantom is held, elsewhere on the rig or in the tissue, or the bench."""
        if not self.effect:
            return "the bench test alone"
        label = self.effect.partition(":")[0]
        held = any(one.group in ("anchor", "grasp") for one in default_catalogue().forms(label))
        return "how the phantom is held" if held else "tissue, table, cameras"

    def undisturbed(self, set_up: SetUp, anchoring: Anchoring) -> SimulatedMounting:
        """Return the simulation without it, in the same tissue."""
        return SimulatedMounting(set_up, anchoring, poisson_ratio=self.poisson_ratio)

    def case(self, set_up: SetUp, anchoring: Anchoring, at: Sequence[float]) -> SimulatedMounting:
        """Return the simulation of sizes at the reference modulus."""
        values = {**self.constants, **{size.name: x for size, x in zip(self.sizes, at, strict=True)}}
        return SimulatedMounting(
            set_up,
            anchoring,
            ((self.effect, written(values)),),
            self.poisson_ratio,
            self.conditioned,
        )
