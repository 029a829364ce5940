"""Causes as another hand would write them: none of these forms is one of the catalogue's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Effect, Motion, Readings, Values
from estimator.effects.shared.on_table import area_on_table
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.assembly.body import Body, Response, forces_of_stress, nodal_forces, stiffness
from estimator.fem.assembly.stress_kernels import first_piola, second_piola
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.quadrature import quadrature_points
from estimator.fem.terms.fibres import Fibres
from estimator.fem.terms.term import Term, TermStiffness
from estimator.materials.invariants import ModifiedInvariants
from estimator.materials.law import EnergyDerivatives, ShapeParameter
from estimator.materials.material import Material, make_material

FloatArray = NDArray[np.float64]
PRESENT = Amplitude("present", "1", scale=1.0, smallest=0.1)
HERE = {PRESENT.name: 1.0}


class Foreign(Effect):
    """An effect that is there or not."""

    label: ClassVar[str] = "unknown"
    group: ClassVar[Group] = "material"
    stage: ClassVar[Stage] = "tissue"
    words: ClassVar[str] = "Another's."
    amplitudes = (PRESENT,)


@dataclass(frozen=True)
class PowerLawMemory:
    """S + ∫ g (1 + (t − s)/t0)^−a dS: the whole history kept, and no Prony term."""

    body: Body
    material: Material
    share: float
    power: float
    first_s: float
    past: tuple[tuple[float, FloatArray], ...] = ()
    last: FloatArray | None = None
    seconds: float = 0.0

    def _weight(self, ago_s: float) -> float:
        return float(self.share * (1.0 + ago_s / self.first_s) ** -self.power)

    @property
    def _gain(self) -> float:
        return self._weight(0.5 * self.seconds)

    def _remembered(self, response: Response) -> FloatArray:
        none = np.zeros_like(response.F)
        last = none if self.last is None else self.last
        return (
            sum((self._weight(ago + self.seconds) * step for ago, step in self.past), none)
            - self._gain * last
        )

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        present = self._gain * nodal_forces(self.body, response, response.slope)
        return present + forces_of_stress(self.body, first_piola(response.F, self._remembered(response)))

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        return TermStiffness(
            elements=self._gain * stiffness(self.body, self.material, response, response.pressure)
        )

    def starting_after(self, seconds: float) -> PowerLawMemory:
        return replace(self, seconds=seconds)

    def after(self, displacement: FloatArray, response: Response) -> PowerLawMemory:
        stress = second_piola(response.F, response.slope)
        step = stress if self.last is None else stress - self.last
        past = tuple((ago + self.seconds, one) for ago, one in self.past)
        return replace(self, past=(*past, (0.5 * self.seconds, step)), last=stress, seconds=0.0)

    def rested(self) -> PowerLawMemory:
        return replace(self, past=(), last=None, seconds=0.0)


class PowerLawRelaxation(Foreign):
    """Tissue that relaxes by a power of time."""

    acts_on: ClassVar[tuple[Hook, ...]] = ("terms",)
    rate_dependent: ClassVar[bool] = True

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        return (PowerLawMemory(problem.body, material, 0.7, 0.4, 1.0),)


class LevellingLaw:
    """∂w/∂x = ½ (1 + k (1 − exp(−(x/x0)²))): stiffens by a bend, and no more beyond it."""

    name = "levelling"
    shape_parameters = (ShapeParameter("k", null=0.0, lower=0.0, upper=9.0, scale=1.0),)
    _x0 = 0.12

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        invariants = ModifiedInvariants.of(i1, i2, j)
        x = np.maximum(invariants.x, 0.0)
        gone = np.exp(-((x / self._x0) ** 2))
        slope = 0.5 * (1.0 + shape[0] * (1.0 - gone))
        bend = shape[0] * x / self._x0**2 * gone
        return invariants.energy(x / 2, (slope, 0.0), (bend, 0.0, 0.0), [(0.5 * (1.0 - gone), 0.0)])


class LevellingStiffening(Foreign):
    """Tissue whose fibres straighten one after the other, and are straight in the end."""

    acts_on: ClassVar[tuple[Hook, ...]] = ("material",)

    def material(self, material: Material, values: Values) -> Material:
        return make_material(LevellingLaw(), material.youngs_modulus, material.poisson_ratio, (0.5,))


class PartialSlip(Foreign):
    """Three patches of the grasp, each with a threshold of its own, drag at the tissue by a power of its speed."""

    stage: ClassVar[Stage] = "motion"
    acts_on: ClassVar[tuple[Hook, ...]] = ("motion",)
    group: ClassVar[Group] = "grasp"

    def motion(self, motion: Motion, values: Values) -> Motion:
        pull = np.linalg.norm(motion.trial[:, :3], axis=1)
        largest = float(pull.max())
        if not largest:
            return motion

        def speed(time_s: float, slip: FloatArray) -> FloatArray:
            acting = np.interp(time_s, motion.time, pull) - 0.35 * largest / 1.5e-3 * slip
            beyond = np.maximum(acting - largest * np.array([0.3, 0.5, 0.7]), 0.0) / largest
            return 1e-3 * beyond**1.5

        solved = solve_ivp(
            speed, motion.time[[0, -1]], np.zeros(3), t_eval=motion.time, max_step=0.25, rtol=1e-6
        )
        slipped = np.asarray(solved.y.mean(axis=0))
        ahead = -motion.trial[:, :3] / np.maximum(pull, 1e-12)[:, None]
        steps = np.diff(slipped, prepend=0.0)[:, None] * motion.rotation.inv().apply(ahead)
        return motion.moved(motion.position - motion.rotation.apply(np.cumsum(steps, axis=0)))


@dataclass(frozen=True, eq=False)
class PlasticFilm:
    """A paste: it drags at each node by τ0 and by the root of its speed since the last state."""

    area: FloatArray
    last: FloatArray
    seconds: float = 0.0

    def _drag(self, displacement: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the drag (n,) by way, how it changes by that (n,), and the directions (n, 2)."""
        moved = displacement[:, :2] - self.last
        way = np.linalg.norm(moved, axis=1) + 1e-9
        speed = way / max(self.seconds, 1e-9)
        creeping = np.tanh(speed / 1e-4)
        stress = 40.0 * creeping + 1500.0 * (np.sqrt(speed + 1e-6) - 1e-3)
        by_speed = 40.0 / 1e-4 * (1 - creeping**2) + 750.0 / np.sqrt(speed + 1e-6)
        moving = self.area * (self.seconds > 0.0)
        return moving * stress / way, moving * by_speed / max(self.seconds, 1e-9), moved / way[:, None]

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        by_way, _, _ = self._drag(displacement)
        moved = displacement[:, :2] - self.last
        return np.column_stack([by_way[:, None] * moved, np.zeros(len(moved))])

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        by_way, ahead, direction = self._drag(displacement)
        along = direction[:, :, None] * direction[:, None, :]
        blocks: FloatArray = np.zeros((len(displacement), 3, 3))
        blocks[:, :2, :2] = by_way[:, None, None] * (np.eye(2) - along) + ahead[:, None, None] * along
        return TermStiffness(nodes=blocks)

    def starting_after(self, seconds: float) -> PlasticFilm:
        return replace(self, seconds=seconds)

    def after(self, displacement: FloatArray, response: Response) -> PlasticFilm:
        return replace(self, last=displacement[:, :2].copy(), seconds=0.0)

    def rested(self) -> PlasticFilm:
        return replace(self, last=np.zeros_like(self.last), seconds=0.0)


class PastyTable(Foreign):
    """A table that is wet with something thick."""

    group: ClassVar[Group] = "environment"
    stage: ClassVar[Stage] = "surroundings"
    acts_on: ClassVar[tuple[Hook, ...]] = ("terms",)
    rate_dependent: ClassVar[bool] = True

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        area = area_on_table(problem)
        return (PlasticFilm(area, np.zeros((len(area), 2))),)


@dataclass(frozen=True)
class TautFibres(Fibres):
    """Fibres of tension alone, of which the stress grows by the square of their extension."""

    def _by_extension(self, extension: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        taut = np.maximum(extension, 0.0)
        slope = self.modulus_pa * (taut + 3.0 * taut**2)
        return np.zeros_like(taut), slope, self.modulus_pa * (1.0 + 6.0 * taut) * (extension > 0.0)


class FanOfFibres(Foreign):
    """Fibres in the plane that scatter about their mean direction as von Mises has it."""

    acts_on: ClassVar[tuple[Hook, ...]] = ("terms",)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        angles = np.arange(18) * np.pi / 18
        density = np.exp(2.0 * np.cos(2 * (angles - 0.5)))
        shares = 0.15 * material.youngs_modulus * density / density.sum()
        return tuple(
            TautFibres(problem.body, float(share), np.array([np.cos(angle), np.sin(angle), 0.0]))
            for share, angle in zip(shares, angles, strict=True)
        )


class SoftBlob(Foreign):
    """An oblong softer place without an edge."""

    acts_on: ClassVar[tuple[Hook, ...]] = ("log_modulus",)

    def log_modulus(self, problem: RetractionProblem, values: Values) -> FloatArray | None:
        arms = quadrature_points(problem.body.mesh)[..., :2] - [-0.012, 0.012]
        along = np.array([[np.cos(0.6), np.sin(0.6)], [-np.sin(0.6), np.cos(0.6)]])
        return np.asarray(-1.1 * np.exp(-0.5 * np.sum((arms @ along.T / [0.017, 0.009]) ** 2, axis=-1)))


class WronglyScaled(Foreign):
    """What the amplifiers make of two axes of the wrench after it was turned into the tissue's axes."""

    group: ClassVar[Group] = "force"
    stage: ClassVar[Stage] = "force"
    acts_on: ClassVar[tuple[Hook, ...]] = ("readings",)
    factors: ClassVar[FloatArray] = np.array([1.0, 1.4, 0.7, 1.0, 1.0, 1.2])

    def readings(self, readings: Readings, values: Values) -> Readings:
        return readings.with_wrench(readings.wrench * self.factors)


class SoakingHeat(Foreign):
    """A sensor into which heat soaks: its zero goes by the root of time."""

    group: ClassVar[Group] = "force"
    stage: ClassVar[Stage] = "force"
    acts_on: ClassVar[tuple[Hook, ...]] = ("readings",)

    def readings(self, readings: Readings, values: Values) -> Readings:
        drifted = np.outer(np.sqrt(readings.experiment.time), [0.02, -0.03, 0.04, 4e-4, 0.0, 5e-4])
        return readings.with_wrench(
            readings.wrench
            + np.hstack([readings.rotation.apply(drifted[:, :3]), readings.rotation.apply(drifted[:, 3:])])
        )


class SecondOrderFilter(Foreign):
    """A force stream behind two filters of 0.2 s, one after the other."""

    group: ClassVar[Group] = "timing"
    stage: ClassVar[Stage] = "force"
    acts_on: ClassVar[tuple[Hook, ...]] = ("readings",)

    def readings(self, readings: Readings, values: Values) -> Readings:
        time = readings.experiment.time
        fine = np.linspace(time[0], time[-1], 40 * len(time))
        step = fine[1] - fine[0]
        wrench = np.column_stack([np.interp(fine, time, column) for column in readings.wrench.T])
        for _ in range(2):
            for n in range(1, len(fine)):
                wrench[n] = wrench[n - 1] + (wrench[n] - wrench[n - 1]) * step / (0.2 + step)
        late = np.column_stack([np.interp(time, fine, column) for column in wrench.T])
        return readings.with_wrench(late)
