"""The tissue rubs on the table below it."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.on_table import area_on_table
from estimator.effects.shared.zeroing import with_wrench_zeroed
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.shares import nodal_volumes
from estimator.fem.terms.film import ViscousFilm
from estimator.fem.terms.friction import LaidDownAnew, LyingOnTable
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# By how much softer half a contact is: on such a table the phantom sinks by as much as it moves when it is free, so
# that a linear search from the baseline arrives somewhere between the two.
_SOFTNESS = 50.0
# The jaws keep the tissue around them off the table, this far.
_CLEARANCE_M = 8e-3


def _unevenness(axis: str) -> Constant:
    """Return by what share of its mean the contact grows from the middle to the side along an axis."""
    return Constant(f"unevenness_{axis}", "1", (0.0,), lower=-1.0, upper=1.0)


class SupportFriction(Effect):
    """The tissue lies on a table, which carries its weight, and rubs on it.

    Coulomb's friction follows the contact pressure, to which stickiness may add. Where the tissue rises, its weight
    draws it down; where it sinks, the table presses. ``contact`` goes from a table that rubs alone (0) over softer ones
    to one in which the phantom sinks by the elastic slip (1). Before each experiment the phantom is laid down anew.
    """

    label: ClassVar[str] = "support_friction"
    # Friction of another form left 0.0017 to a stray fibre, 0.0020 to a soft region; with adhesion, in its own form, it
    # left 0.0033 to a time offset.
    inexactness: ClassVar[float] = 3.5e-3
    group: ClassVar[Group] = "environment"
    needs_table: ClassVar[bool] = True
    stage: ClassVar[Stage] = "surroundings"
    acts_on: ClassVar[tuple[Hook, ...]] = ("terms",)
    words: ClassVar[str] = "The tissue rubs on the table below it."
    law: ClassVar[type[LyingOnTable]] = LaidDownAnew
    form = "laid_down_anew"
    amplitudes: tuple[Amplitude, ...] = (
        Amplitude("coefficient", "1", scale=0.5, smallest=0.02, lower=0.0, upper=4.0),
        Amplitude("contact", "1", scale=0.8, smallest=0.02, lower=0.0, upper=1.0),
    )
    constants: tuple[Constant, ...] = (
        Constant("adhesion", "Pa", (40.0,), lower=4.0, upper=400.0),
        Constant("elastic_slip", "m", (2e-4,), lower=2e-5, upper=2e-3),
    )

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Let every node on the table rub."""
        if not _present(values):
            return ()
        area = area_on_table(problem)
        evenness = self._evenness(problem, experiment, values)
        gravity = -experiment.environment.gravity[2]
        weight = experiment.phantom.density * gravity * float(nodal_volumes(problem.body.mesh).sum())
        touching = np.where(_clear_of_jaws(problem), area, 0.0)
        return (
            self.law.at_rest(
                weight / float(area.sum()) * touching * evenness,
                values["adhesion"] * touching * evenness,
                values["coefficient"],
                values["elastic_slip"],
                _depth(values),
                values.get("breakaway", 0.0),
            ),
        )

    def _evenness(self, problem: RetractionProblem, experiment: Experiment, values: Values) -> FloatArray:
        """Return the factor (n,) on what each node rests on the table with."""
        return np.ones(len(problem.body.mesh.points))


class UnevenSupportFriction(SupportFriction):
    """The tissue bears more on one side of the table than on the other, where it is wet or lifts off."""

    form = "uneven"
    elaborates = "laid_down_anew"
    constants = (*SupportFriction.constants, _unevenness("x"), _unevenness("y"))

    def _evenness(self, problem: RetractionProblem, experiment: Experiment, values: Values) -> FloatArray:
        half = np.array(experiment.phantom.size_m)[:2] / 2
        slopes = np.array([values[f"unevenness_{axis}"] for axis in "xy"])
        return np.clip(1.0 + (problem.body.mesh.points[:, :2] / half) @ slopes, 0.0, None)


class ViscousSupportFriction(SupportFriction):
    """A film between tissue and table drags by the speed as well, and the dry part sticks more before it has slid."""

    form = "viscous"
    elaborates = "laid_down_anew"
    rate_dependent: ClassVar[bool] = True
    amplitudes = (
        *SupportFriction.amplitudes,
        # 50 Pa, about a usual dry friction, at 1 mm/s
        Amplitude("viscosity", "Pa·s/m", scale=5e4, smallest=2e3, lower=0.0, upper=1e7),
    )
    constants = (*SupportFriction.constants, Constant("breakaway", "1", (0.0,), lower=0.0, upper=2.0))

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Let every node on the table rub, and the film drag at it."""
        dry = super().terms(problem, material, experiment, values)
        if not values["viscosity"]:
            return dry
        touching = np.where(_clear_of_jaws(problem), area_on_table(problem), 0.0)
        return (*dry, ViscousFilm.at_rest(values["viscosity"] * touching))


class SupportFrictionLeftLying(SupportFriction):
    """Between experiments the phantom stays as it lies, held by what has rubbed; the sensor's zero hides the force."""

    law = LyingOnTable
    acts_on = ("terms", "readings")
    form = "left_lying"
    elaborates = "laid_down_anew"

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take off the wrench in which each experiment began."""
        return with_wrench_zeroed(readings) if _present(values) else readings


def _present(values: Values) -> bool:
    return bool(values["coefficient"] or values["contact"])


def _depth(values: Values) -> float:
    """Return the depth, m, to which the phantom sinks at rest."""
    contact = values["contact"]
    return values["elastic_slip"] * (1.0 + _SOFTNESS * (1.0 - contact) / contact) if contact else np.inf


def _clear_of_jaws(problem: RetractionProblem) -> NDArray[np.bool_]:
    points = problem.body.mesh.points
    distance, _ = KDTree(points[problem.gripped]).query(points)
    return np.asarray(distance > _CLEARANCE_M)


SUPPORT_FRICTION = (
    SupportFriction(),
    SupportFrictionLeftLying(),
    UnevenSupportFriction(),
    ViscousSupportFriction(),
)
