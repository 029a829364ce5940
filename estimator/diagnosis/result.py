"""What a diagnosis says, as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.rivals import Rivals
from estimator.diagnosis.noise.errors_left import ErrorsLeft
from estimator.experiment import Experiment
from estimator.fem.discretisation.mesh import Mesh

FloatArray = NDArray[np.float64]
State = Literal["present", "negligible", "absent", "cannot_tell", "not_solved"]


@dataclass(frozen=True)
class Quantity:
    """A value with its standard deviation and unit."""

    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class EffectFinding:
    """What is known of one effect of the catalogue.

    Attributes
    ----------
    label, form, group, words : of the effect's best form
    probability : that it is the leading cause, alone or with others
    state : present, negligible, absent, or not to be told from these data; or not solved, where the tissue had no
        equilibrium with it: then it is neither refuted nor borne out
    parameters : at their best, by name
    chi2_drop : of the misfit once the effect is in and everything refitted
    closure_held_out : share of the gap that it closes on experiments left out of the fit; None where not computed
    detectable : for each amplitude the size that these data would show at three standard deviations, its unit
    """

    label: str
    form: str
    group: str
    words: str
    probability: float
    state: State
    parameters: Mapping[str, Quantity]
    chi2_drop: float
    closure_held_out: float | None
    detectable: Mapping[str, Quantity]


@dataclass(frozen=True)
class Gap:
    """Root mean square misfit in units of the noise: of the baseline, with the causes in, and of noise alone.

    ``before`` and ``after`` are of experiments left out of the fit; so is their closure
    (before − after) / (before − floor), NaN where the gap before is within the noise, with its standard deviation.
    """

    before: float
    after: float
    floor: float
    closure_held_out: float
    closure_std: float = float("nan")


@dataclass(frozen=True)
class Material:
    """E (Pa) and ν with standard deviations."""

    youngs_modulus: Quantity
    poisson_ratio: Quantity


@dataclass(frozen=True)
class Place:
    """Where a local cause sits in the tissue: centre and radius, m."""

    centre: tuple[float, float, float]
    radius: float


@dataclass(frozen=True)
class Outcome:
    """The model with one cause in it, fitted.

    Attributes
    ----------
    parameters : of the cause, by name
    material : E and ν beside it
    gap : of all data without and with it, on experiments left out of the fit
    place : of the cause; None for one that sits nowhere in particular
    channels : for each experiment (n, 6 + 3m), predicted; NaN may stand where nothing was measured
    """

    parameters: Mapping[str, Quantity]
    material: Material
    gap: Gap
    place: Place | None
    channels: tuple[FloatArray, ...]


@dataclass(frozen=True)
class Consideration:
    """One cause alone beside the baseline: as its signature makes one expect, and refitted in full where it was."""

    expected: Outcome
    achieved: Outcome | None


@dataclass(frozen=True)
class Where:
    """Where the gap lies.

    Attributes
    ----------
    channels : share of the baseline's excess misfit by channel: fx .. tz, and x, y, z of the fiducials
    steps : the same by experiment and phase, "pull/ramp"
    blocks : probability of each block of the rig: interior, grasp, anchor, support, geometry, force, vision, robot,
        timing
    centre, centre_std, radius : m; of a local cause, None where there is none
    """

    channels: Mapping[str, float]
    steps: Mapping[str, float]
    blocks: Mapping[str, float]
    centre: tuple[float, float, float] | None
    centre_std: tuple[float, float, float] | None
    radius: float | None

    @property
    def block(self) -> str:
        """The most probable block."""
        return max(self.blocks, key=lambda name: self.blocks[name])


@dataclass(frozen=True)
class Manoeuvre:
    """A motion out and back: the farthest offset from the grasp (m), a turn (rad, about tissue axes), words."""

    words: str
    offset_m: tuple[float, float, float]
    turn_rad: tuple[float, float, float]


@dataclass(frozen=True)
class Advice:
    """A manoeuvre or measurement that would separate two remaining causes.

    Attributes
    ----------
    manoeuvre : in words
    separates : labels of the two
    sigma_now, sigma_then : their distance in standard deviations now, and with the manoeuvre; NaN where it is a
        measurement beside the rig, which cannot be rehearsed
    motion : of the gripper, where that is what is advised
    """

    manoeuvre: str
    separates: tuple[str, str]
    sigma_now: float
    sigma_then: float
    motion: Manoeuvre | None = None


@dataclass(frozen=True, eq=False)
class DeformedMesh:
    """The body through one experiment, as the baseline has it.

    Attributes
    ----------
    mesh : at rest
    displacements : (s, p, 3) of its nodes in each state, m
    state_of_row : (n,) which of them each row shows
    """

    mesh: Mesh
    displacements: FloatArray
    state_of_row: NDArray[np.int64]


@dataclass(frozen=True)
class Trace:
    """Measured and predicted channels of one experiment, its noise, and how the body deforms.

    Attributes
    ----------
    experiment : Experiment
    before, after : (n, 6 + 3m) channels predicted by the baseline, and with the causes in
    deviation : (6 + 3m,) standard deviation of one value
    body : of the baseline, whatever the causes
    """

    experiment: Experiment
    before: FloatArray
    after: FloatArray
    deviation: FloatArray
    body: DeformedMesh


@dataclass(frozen=True)
class Diagnosis:
    """The whole answer.

    Attributes
    ----------
    verdict : labels of the causes, the leading one first, "unknown" among them where something without a label is one,
        or more remains than they explain; empty for none, ("unknown",) for a gap that nothing in the catalogue explains
    probabilities : of the leading single cause, "none" and "unknown" among them
    credible_set : the smallest set of probable answers with 90 %
    chance : share of noises alone, none of them with a cause, that would feign one as strong as the strongest found
    effects : by label; by "unknown" too where that was recognised as something which has no label
    gap, by_channel, by_experiment : Gap of all data, of force, torque and fiducials, and of each experiment
    gap_at_most : of force, torque and fiducials, root mean square: a gap of the baseline beyond what is told here would
        have shown with 95 %, what the model's own error may hide included
    where : Where
    before, after : material without causes, and with them and with the uncertainty of naming them
    prior_shares : how much of what is known of E and ν their priors give, from 0 to 1; by name, without what was given
    at_bound : names of those that stand at a bound
    cannot_tell : sentences: what these data do not say
    next_experiment : Advice, the best first
    outliers : how many single readings of a bead were left out as wild
    errors_left : how much of the errors that rows may share was taken for noise
    traces : one an experiment
    rivals : what the effects of the catalogue would do to these measurements, and how alike
    considered : by label, what each cause alone would do
    seconds : that it took
    """

    verdict: tuple[str, ...]
    probabilities: Mapping[str, float]
    credible_set: tuple[str, ...]
    chance: float
    effects: Mapping[str, EffectFinding]
    gap: Gap
    by_channel: Mapping[str, Gap]
    by_experiment: Mapping[str, Gap]
    gap_at_most: Mapping[str, Quantity]
    where: Where
    before: Material
    after: Material
    cannot_tell: tuple[str, ...]
    next_experiment: tuple[Advice, ...]
    outliers: int
    errors_left: ErrorsLeft
    traces: tuple[Trace, ...]
    rivals: Rivals
    considered: Mapping[str, Consideration]
    seconds: float
    prior_shares: Mapping[str, float] = field(default_factory=dict)
    at_bound: tuple[str, ...] = ()
