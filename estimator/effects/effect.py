"""What an effect is: a parameterised departure of the baseline with a null at which it vanishes.

An effect may act in six places, each a method that by default changes nothing: the tissue's material, the boundary
value problem (geometry, anchors), the field of its stiffness, further forces on the tissue, the gripper's true motion,
and what the sensors make of the truth. All amplitudes at their null, every method must return what it was given.
Several usual forms are several instances with one label; a constant states a grid from which a refit starts.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.blocks import GROUPS, Block, Group
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
Values = Mapping[str, float]

_HOOKS_OF_MECHANICS: frozenset[Hook] = frozenset(("material", "problem", "log_modulus", "terms", "motion"))

# Label of an effect outside the catalogue, whose labels others read: a form by which something unknown is recognised.
OUTSIDE = "unknown"

# Inexactness of what has hardly another form, as a constant linear change of readings or poses: beside fifteen such
# causes of 113 to 327 σ, which raised it by 1700 to 19000, others seemed to raise the log evidence by 4.9 at the most.
HARDLY_INEXACT = 2e-4


@dataclass(frozen=True, slots=True)
class Amplitude:
    """A parameter that is zero where the effect is absent.

    Attributes
    ----------
    name, unit : SI; "1" for a pure number
    scale : standard deviation of its prior, a usual size where the effect is present
    smallest : size below which nobody would care
    lower, upper : bounds; a one-sided effect has one of them at zero

    Examples
    --------
    >>> from estimator import Amplitude
    >>> Amplitude("rate", "N/s", scale=1e-3, smallest=1e-4, lower=0.0)
    Amplitude(name='rate', unit='N/s', scale=0.001, smallest=0.0001, lower=0.0, upper=inf)
    """

    name: str
    unit: str
    scale: float
    smallest: float
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True, slots=True)
class Constant:
    """A parameter without a null, such as a relaxation time or a place: a grid to start from, and bounds.

    A fixed one stays where a search began: a number of a bead, an instant between two rows.
    """

    name: str
    unit: str
    grid: tuple[float, ...]
    lower: float
    upper: float
    fixed: bool = False


@dataclass(frozen=True)
class Motion:
    """The motion of the gripper in one experiment with n rows.

    Attributes
    ----------
    experiment : as it was recorded
    position : (n, 3) origin of the gripper frame, tissue frame, m
    rotation : n rotations of the gripper frame, identity at rest
    load : (n, 6) wrench of the tissue on the gripper, which drives compliance: mean over a pose, zero in the first row
    trial : (n, 6) wrench of the baseline at the reported poses with the present modulus, had nothing given way
    time : (n,) s
    """

    experiment: Experiment
    position: FloatArray
    rotation: Rotation
    load: FloatArray
    trial: FloatArray
    time: FloatArray

    def moved(self, position: FloatArray, rotation: Rotation | None = None) -> Motion:
        """Return the motion with other positions (and rotations)."""
        return replace(self, position=position, rotation=rotation or self.rotation)


@dataclass(frozen=True)
class Readings:
    """What the sensors of one experiment would read, n rows and m fiducials.

    Attributes
    ----------
    experiment : as it was recorded
    position, rotation : true pose of the gripper, as in :class:`Motion`
    reported_position : (n, 3) the mean of the reported positions of each stay, m
    wrench : (n, 6) of the tissue on the gripper, tissue axes, about the gripper frame's present origin, N and N·m
    fiducials : (n, m, 3), tissue frame, m
    rest_wrench, rest_fiducials : (6,) and (m, 3), of the tissue with the gripper exactly at its stated rest pose
    """

    experiment: Experiment
    position: FloatArray
    rotation: Rotation
    reported_position: FloatArray
    wrench: FloatArray
    fiducials: FloatArray
    rest_wrench: FloatArray
    rest_fiducials: FloatArray

    def with_wrench(self, wrench: FloatArray) -> Readings:
        """Return the readings with another wrench."""
        return replace(self, wrench=wrench)

    def with_fiducials(self, fiducials: FloatArray, at_rest: FloatArray | None = None) -> Readings:
        """Return the readings with other fiducial positions, and with others at rest where given."""
        rest = self.rest_fiducials if at_rest is None else at_rest
        return replace(self, fiducials=fiducials, rest_fiducials=rest)


class Effect:
    """A departure of the baseline; see the module's text. Subclasses override what they change.

    Attributes
    ----------
    label, form : its name in verdicts and commands; forms tell instances with one label apart
    group : what kind it is, which tells the block of the rig where it sits
    stage : where it comes between the tissue and the recording
    acts_on : the methods that it overrides, in the order of ``HOOKS``
    measured_by : what a measurement beside the rig that would tell it from others does; empty where none is known
    laws : names of the material laws whose departure from the Neo-Hookean one it is
    linear : whether what it changes of motion and readings is proportional to its amplitudes
    amplitudes, constants : its parameters
    words : what a report says of it, one sentence
    fewest_beads, fewest_experiments : how many there must be for it to show; for any of the cameras one bead at least
    needs_table, needs_platens : whether it is there only on a table, or where a body is pressed between two plates
    of_single_beads : whether it befalls single beads in the tissue, which no marker or board is taken for
    rate_dependent : whether the tissue changes while the gripper stands
    elaborates : form of the same label of which this one is a refinement, looked at only where that one leads
    accident : whether it happens at one instant; it is looked at as well where something unknown leads
    mistaken_for : labels of the catalogue in whose place one without a label is looked at; none for one that always is
    terms_alike : whether it is a sum of terms that may change places: none is where a single one fits best
    keeps_pattern : whether :meth:`problem` leaves free and held nodes as they are
    within_elements : whether it ends within elements, which then have to follow it for its size to be known
    at_thresholds : whether it sets in where something yields: its null tells little, and differences need short steps
    rest_seen : whether the cameras read the beads' stated rest positions once the tissue was mounted
    inexactness : share of what it raises the log evidence by that others seem to explain, its form being inexact

    Examples
    --------
    >>> import numpy as np
    >>> from estimator import Amplitude, Effect, Experiment, simulate
    >>> class SensorHeat(Effect):
    ...     label, group, stage, acts_on = "sensor_heat", "force", "force", ("readings",)
    ...     words = "The force sensor warms up."
    ...     amplitudes = (Amplitude("rate", "N/s", scale=1e-3, smallest=1e-4),)
    ...
    ...     def readings(self, readings, values):
    ...         more = np.outer(readings.experiment.time, [values["rate"], 0, 0, 0, 0, 0])
    ...         return readings.with_wrench(readings.wrench + more)
    >>> planned = Experiment.of_block([(0, 0, 0), (0.002, 0, 0)])
    >>> (cold,) = simulate(planned, mesh="coarse")
    >>> (warm,) = simulate(planned, effects=[(SensorHeat(), {"rate": 0.5})], mesh="coarse")
    >>> round(float(warm.wrench[1, 0] - cold.wrench[1, 0]), 3)
    0.5
    """

    label: ClassVar[str]
    group: ClassVar[Group]
    words: ClassVar[str]
    stage: ClassVar[Stage]
    acts_on: ClassVar[tuple[Hook, ...]]
    measured_by: ClassVar[str] = ""
    laws: ClassVar[tuple[str, ...]] = ()
    linear: ClassVar[bool] = False
    fewest_beads: ClassVar[int] = 0
    fewest_experiments: ClassVar[int] = 1
    needs_table: ClassVar[bool] = False
    needs_platens: ClassVar[bool] = False
    of_single_beads: ClassVar[bool] = False
    rate_dependent: ClassVar[bool] = False
    keeps_pattern: ClassVar[bool] = True
    terms_alike: ClassVar[bool] = False
    inexactness: ClassVar[float] = 1e-3
    within_elements: ClassVar[bool] = False
    at_thresholds: ClassVar[bool] = False
    rest_seen: bool = False
    elaborates: str = ""
    accident: ClassVar[bool] = False
    mistaken_for: tuple[str, ...] = ()
    form: str = ""
    amplitudes: tuple[Amplitude, ...] = ()
    constants: tuple[Constant, ...] = ()

    @property
    def name(self) -> str:
        """Label and form in one word."""
        return f"{self.label}:{self.form}" if self.form else self.label

    @property
    def block(self) -> Block:
        """The block of the rig on which it acts."""
        return GROUPS[self.group]

    @property
    def acts_on_tissue(self) -> bool:
        """Whether it changes the mechanics or where beads sit in them."""
        return self.misreads_rest or not _HOOKS_OF_MECHANICS.isdisjoint(self.acts_on)

    @property
    def misreads_rest(self) -> bool:
        """Whether it distorts cameras that have read the beads' stated rest positions: they sit elsewhere."""
        return self.rest_seen and "seen" in self.acts_on

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the constants from which a search begins: by default every point of their grid.

        ``baseline`` holds what the fitted baseline predicts for each experiment, beside what was measured: an effect
        with many places (which bead?) may pick the likely ones.
        """
        grids = [[(constant.name, value) for value in constant.grid] for constant in self.constants]
        return [dict(point) for point in itertools.product(*grids)]

    def looked_for_in(self, experiments: Sequence[Experiment]) -> Effect:
        """Return the effect as it is looked for in these experiments: one with a size for each has as many sizes."""
        return self

    def looked_for_at(self, centre: FloatArray, radius_m: float) -> Effect:
        """Return the effect as it is looked for where one that it is mistaken for lies, centre (3,) and radius in m."""
        return self

    def past_kinks(self, problem: RetractionProblem, values: Values) -> list[dict[str, float]]:
        """Return values at which to begin anew where a refit may have stopped at a kink of the misfit; mostly none."""
        return []

    def looked_over(self, best: Values | None = None) -> list[dict[str, float]]:
        """Return values at full size to look among, where the null hardly tells; then those near the best of them."""
        return []

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return how many equally likely values of its fixed constants a search, and noise with it, chooses among."""
        return 1

    def place(self, problem: RetractionProblem, values: Values) -> tuple[FloatArray, float] | None:
        """Return centre (3,) and radius, m, of an effect that sits somewhere in the tissue; None for others."""
        return None

    def material(self, material: Material, values: Values) -> Material:
        """Return the material under the effect."""
        return material

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Return the boundary value problem under the effect; mesh topology and node order stay."""
        return problem

    def beads(self, problem: RetractionProblem, at_rest: FloatArray, values: Values) -> RetractionProblem:
        """Return the problem with beads on their tissue; ``at_rest`` (n, 3): displacement of the nodes at rest, m."""
        return problem

    def log_modulus(self, problem: RetractionProblem, values: Values) -> FloatArray | None:
        """Return the logarithm (e, q) of the factor on the tissue's stiffness at the integration points, or None."""
        return None

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Return what acts on the tissue besides its own stress, at the start of an experiment."""
        return ()

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Return the gripper's true motion."""
        return motion

    def seen(self, positions: FloatArray, values: Values) -> FloatArray:
        """Return where cameras see what is at positions (..., 3), tissue frame, m."""
        return positions

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Return what the sensors make of the truth."""
        return readings
