"""The candidate causes of a published gap: effects of the catalogue over a range of sizes, and factors on the bench.

What acts on the retraction is an effect of :mod:`estimator.effects`; its size is its first amplitude, with the prior of
its catalogue entry: a normal distribution with the usual size as deviation, its positive half where the effect has a
sign. A size with a stiffness of its own is simulated at the reference modulus: a compliance C m/N does to tissue of
modulus E what C E / E₀ does at E₀, a weight or a force the inverse.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

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

    def of_quantile(self, share: FloatArray) -> FloatArray:
        """Return sizes at shares (...,) of the prior's probability."""
        if self.between is not None:
            low, high = self.between
            return np.asarray(low * (high / low) ** share)
        if self.one_sided:
            return np.asarray(self.deviation * norm.ppf(0.5 + 0.5 * share))
        return np.asarray(self.deviation * norm.ppf(share))

    def at_reference(self, size: FloatArray, modulus: FloatArray) -> FloatArray:
        """Return the size at the reference modulus that does the same as ``size`` in tissue of ``modulus``, Pa."""
        scaled = size * (modulus / REFERENCE_PA) ** self.grows_with
        lower = self.nodes[0] if self.between is not None else min(0.0, self.nodes[0])
        return np.clip(scaled, lower, self.nodes[-1])

    def in_tissue(self, at_reference: FloatArray, modulus: float) -> FloatArray:
        """Return the size in tissue of a modulus, Pa, that does what another does at the reference modulus."""
        return np.asarray(at_reference * (modulus / REFERENCE_PA) ** -self.grows_with)


@dataclass(frozen=True, eq=False)
class Candidate:
    """A cause that may have acted on the retractions, or on the bench test they are held against.

    Attributes
    ----------
    name : its own, short
    words : a line of a report
    effect : of the catalogue; empty where it acts on the bench test alone
    sizes : one or two; the others of the effect's parameters are ``constants``
    conditioned : whether the phantom had been drawn farther before
    on_bench : how log E of the tissue lies off the bench test's by its size: none, all materials alike, each by itself,
        or as much as the size lets relax
    direct_check : what measurement beside the retraction tells it
    checks : sizes at the reference modulus that the learnt map is checked at
    poisson_ratio : of the tissue that it is simulated in; what it changes is taken over to nearly incompressible tissue
    """

    name: str
    words: str
    effect: str = ""
    sizes: tuple[Size, ...] = ()
    constants: Mapping[str, float] = field(default_factory=dict)
    conditioned: bool = False
    on_bench: str = "none"
    direct_check: str = ""
    checks: tuple[tuple[float, ...], ...] = ()
    poisson_ratio: float = USUAL_RATIO

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


_SIGNED_MM = (-8e-3, -4e-3, -2e-3, 2e-3, 4e-3)
# Log E of the bench test off that of the tissue at small strain: a third either way is one deviation.
_BENCH = 0.3


def _deformation(
    name: str,
    words: str,
    effect: str,
    size: Size,
    checks: Sequence[float],
    direct: str,
    constants: Mapping[str, float] | None = None,
    on_bench: str = "none",
    conditioned: bool = False,
    poisson_ratio: float = USUAL_RATIO,
) -> Candidate:
    return Candidate(
        name,
        words,
        effect,
        (size,),
        constants or {},
        conditioned,
        on_bench,
        direct,
        tuple((x,) for x in checks),
        poisson_ratio,
    )


CANDIDATES: tuple[Candidate, ...] = (
    Candidate(
        "gripper_slip",
        "tissue slides in the gripper beyond a force",
        "gripper_slip:gradual",
        (
            Size("slip_per_force", "m/N at 5 kPa", (4e-3, 9e-3, 1.2e-2, 1.5e-2), 8e-3),
            Size("threshold", "N", (0.02, 0.06, 0.12, 0.25, 0.5), 0.0, -1, between=(0.03, 3.0)),
        ),
        direct_check="mark the tissue at the jaws and measure the mark's way against the gripper's",
        checks=((6e-3, 0.04), (1.05e-2, 0.09), (1.2e-2, 0.17)),
    ),
    _deformation(
        "gripper_compliance",
        "gripper or arm gives way elastically",
        "gripper_compliance:translation",
        Size("compliance", "m/N", (1e-3, 3e-3, 8e-3, 1.6e-2), 5e-4, grows_with=1),
        (2e-3, 5e-3),
        "hang a known weight on the closed jaws and measure by how much they sink",
    ),
    _deformation(
        "grasp_along",
        "the jaws hold the tissue nearer to the anchor (−) or farther from it (+) than stated",
        "grasp_misplacement:jaws",
        Size("shift_x", "m", _SIGNED_MM, 3e-3, one_sided=False),
        (-3e-3, 3e-3),
        "measure from the anchored face to the edge of the jaws",
        {"shift_y": 0.0},
    ),
    _deformation(
        "gripper_along",
        "the gripper stood nearer to the anchor (−) or farther from it (+) than registered",
        "grasp_misplacement:gripper",
        Size("shift_x", "m", _SIGNED_MM, 3e-3, one_sided=False),
        (-3e-3, 3e-3),
        "measure from the anchored face to the edge of the jaws",
        {"shift_y": 0.0},
    ),
    _deformation(
        "anchor_compliance",
        "the anchored face gives way elastically",
        "anchor_compliance:isotropic",
        Size("length", "m of tissue", (1e-3, 4e-3, 9e-3, 18e-3), 4e-3),
        (2e-3, 6e-3),
        "put beads on the anchored face and see whether they move",
    ),
    *(
        _deformation(
            f"debonding_{where}",
            f"part of the anchored face has come off, {words}",
            "anchor_debonding:throughout",
            Size("share", "of the area", nodes, 0.2),
            checks,
            "look along the anchored face under load",
            {"place": place},
        )
        for where, words, place, nodes, checks in (
            (
                "end",
                "from the far end of its rim",
                1.0,
                (0.03, 0.06, 0.1, 0.14, 0.17, 0.2, 0.23, 0.26),
                (0.08, 0.185, 0.215),
            ),
            ("middle", "in its middle", 0.5, (0.1, 0.2, 0.25, 0.3, 0.36, 0.42, 0.5), (0.17, 0.39)),
        )
    ),
    _deformation(
        "support_friction",
        "the phantom rubs on the table",
        "support_friction:laid_down_anew",
        Size("coefficient", "1", (0.1, 0.3, 0.8, 1.6), 0.5, grows_with=-1),
        (0.2, 0.5),
        "retract once more on a wetted or powdered table",
        {"contact": 0.0, "adhesion": 40.0},
    ),
    _deformation(
        "prestretch",
        "the phantom was mounted under tension that the sensor's zero hides",
        "prestretch:along",
        Size("along", "m", (1e-3, 2.5e-3, 5e-3), 1.5e-3),
        (1.7e-3,),
        "zero the sensor before the jaws close",
    ),
    _deformation(
        "thickness",
        "the phantom is thicker (+) or thinner (−) than stated",
        "thickness_error:about_middle",
        Size("excess", "1", (-0.4, -0.2, -0.1, 0.1, 0.2), 0.08, one_sided=False),
        (-0.15, 0.15),
        "measure its thickness with a calliper",
    ),
    _deformation(
        "camera_scale",
        "the cameras see motion too large (+) or too small (−)",
        "camera_scale:uniform",
        Size("scale_error", "1", (-0.06, -0.03, 0.03, 0.06), 0.015, one_sided=False),
        (-0.015, 0.045),
        "compare the spacing of the beads at rest with the mould's",
    ),
    _deformation(
        "stiffening",
        "the silicone stiffens with strain",
        "strain_stiffening:yeoh2",
        Size("c2", "1", (0.3, 0.8, 1.6), 0.47),
        (0.5, 1.2),
        "fit E by the length of the pull, and a law to the bench test's record",
    ),
    _deformation(
        "relaxation",
        "stress relaxes between steps, and the bench test was faster",
        "viscoelasticity:one_term",
        Size("relaxing_share_1", "of the stress that stays", (0.15, 0.4, 0.8), 0.4),
        (0.25, 0.6),
        "hold the last step for a minute and look at the force",
        {"relaxation_time_1": 8.0},
        on_bench="relaxed",
    ),
    _deformation(
        "mullins",
        "the phantoms had been stretched before, the bench test's specimens not",
        "stress_softening:absolute_width",
        Size("depth", "of the stress", (0.15, 0.35, 0.6), 0.2),
        (0.25, 0.45),
        "test a fresh specimen twice in a row on the bench",
        {"width_over_modulus": 0.002},
        conditioned=True,
    ),
    # Lying phantoms hang by what the table does not carry. More than the last of these, a millimetre's sag, does not
    # solve from the flat sheet, and that only where the tissue is less near to incompressible.
    _deformation(
        "gravity_sag",
        "the table does not carry all of the phantom's weight, and it sags",
        "gravity_sag:beads_hanging",
        Size("weight", "of its own", (0.01, 0.02, 0.03), 0.05, grows_with=-1),
        (0.015,),
        "measure the height of the beads at rest against that of the anchor",
        poisson_ratio=0.40,
    ),
    Candidate(
        "bench_strain",
        "the bench modulus was read at another strain, or scaled by another common factor",
        sizes=(
            Size("log_factor", "ln E of the tissue over the bench's", (-1.5, 1.5), _BENCH, one_sided=False),
        ),
        on_bench="common",
        direct_check="fit the bench test's record over the strains of the retraction",
    ),
    Candidate(
        "bench_error",
        "the bench test is off by another factor for each mixture",
        sizes=(Size("deviation", "of ln E between mixtures", (1e-3, 1.5), _BENCH),),
        on_bench="each",
        direct_check="test specimens cut from the phantoms themselves",
    ),
)
