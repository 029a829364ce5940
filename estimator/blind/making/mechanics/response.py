"""What the material remembers: relaxation, softening, a permanent set, and changes that come with time."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.mechanics.laws import Law

FloatArray = NDArray[np.float64]

_UNIT = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True, slots=True)
class Instant:
    """When a state is sought.

    Attributes
    ----------
    time : since the first row of this experiment, s
    interval : since the state before, s
    order : of the experiment on this mounting, from 1
    travel : how far the gripper is from its rest position, m
    """

    time: float
    interval: float
    order: int
    travel: float


class Softening(Protocol):
    """How much stress is left, given the energy density and its largest value so far, J/m³."""

    def __call__(self, energy: FloatArray, peak: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the factor and its derivative by the energy, (n,) each."""
        ...


@dataclass(frozen=True, slots=True)
class Relaxation:
    """Maxwell elements beside the spring.

    Attributes
    ----------
    shares : of the spring's stiffness
    times : time constants, s
    energy_scale : J/m³; what relaxes is the spring's stress times 1 + W / this, W its energy density (Pipkin and
        Rogers 1968): the more, the larger the strain; None: in proportion
    """

    shares: tuple[float, ...]
    times: tuple[float, ...]
    energy_scale: float | None = None

    def driven(self, energy: FloatArray, S: FloatArray, D: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what relaxes of a stress S (n, 6) with tangent D (n, 6, 6) and energy (n,), and its tangent."""
        if self.energy_scale is None:
            return S, D
        factor = 1 + energy / self.energy_scale
        grows = S[:, :, None] * S[:, None, :] / self.energy_scale
        return factor[:, None] * S, factor[:, None, None] * D + grows


@dataclass(frozen=True, slots=True)
class PermanentSet:
    """A share of the largest strain that stays.

    Attributes
    ----------
    share : of that strain
    time : constant with which it grows towards that, s; 0: at once
    yields_at : strain below which nothing stays
    per_strain : by how much the share grows with the strain beyond that, 1
    """

    share: float
    time: float = 0.0
    yields_at: float = 0.0
    per_strain: float = 0.0


@dataclass(frozen=True)
class Material:
    """A law with what varies over the body and in time.

    Attributes
    ----------
    law : of the elastic part
    stiffness : (n,) local factor at every quadrature point
    tear : returns (n,) further factors at an instant, which only ever fall
    seasons : factor of the whole stress at an instant
    swelling : linear factor of the natural size at an instant
    mended : share of softening and set that is gone when the next experiment begins
    """

    law: Law
    stiffness: FloatArray
    relaxation: Relaxation | None = None
    softening: Softening | None = None
    permanent_set: PermanentSet | None = None
    tear: Callable[[Instant], FloatArray] | None = None
    seasons: Callable[[Instant], float] | None = None
    swelling: Callable[[Instant], float] | None = None
    mended: float = 0.0

    @property
    def remembers(self) -> bool:
        """Whether stress depends on more than the present deformation."""
        return any((self.relaxation, self.softening, self.permanent_set, self.tear, self.seasons))


@dataclass(frozen=True, slots=True)
class Memory:
    """The history of n quadrature points.

    Attributes
    ----------
    peak : (n,) largest energy density, J/m³
    set : (n, 6) Green-Lagrange strain that stays, nothing doubled
    elastic : (n, 6) stress of the spring at the last instant, Pa
    overstress : (m, n, 6) of each Maxwell element, Pa
    intact : (n,) share of the stiffness that is not torn
    """

    peak: FloatArray
    set: FloatArray
    elastic: FloatArray
    overstress: FloatArray
    intact: FloatArray = field(default_factory=lambda: np.ones(1))


def at_rest(material: Material) -> Memory:
    """Return the memory of a body that was never loaded."""
    n = len(material.stiffness)
    elements = len(material.relaxation.times) if material.relaxation else 0
    return Memory(np.zeros(n), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((elements, n, 6)), np.ones(n))


def rested(material: Material, memory: Memory) -> Memory:
    """Return the memory after a long rest: overstress is gone, softening and set stay but for what has mended."""
    kept = 1 - material.mended
    return replace(
        memory,
        peak=kept * memory.peak,
        set=kept * memory.set,
        elastic=np.zeros_like(memory.elastic),
        overstress=np.zeros_like(memory.overstress),
    )


def respond(
    material: Material, C: FloatArray, memory: Memory, instant: Instant
) -> tuple[FloatArray, FloatArray, Memory]:
    """Return stress S (n, 6), tangent D (n, 6, 6) and the memory that holds if this state is kept.

    The set follows the kept states, one behind; overstress is integrated exactly for a stress that changes linearly
    in time (Taylor, Pister and Goudreau 1970; Simo 1987).
    """
    size = material.swelling(instant) if material.swelling else 1.0
    elastic_C = C / size**2 - 2 * memory.set
    energy, S, D = material.law.stress(elastic_C)
    S, D = S / size**2, D / size**4
    peak = np.maximum(memory.peak, energy)
    if material.softening:
        factor, slope = material.softening(energy, peak)
        D = factor[:, None, None] * D + slope[:, None, None] * S[:, :, None] * S[:, None, :]
        S = factor[:, None] * S
    intact = memory.intact
    if material.tear:
        intact = np.minimum(intact, material.tear(instant))
    local = material.stiffness * intact
    if material.seasons:
        local = local * material.seasons(instant)
    S, D = local[:, None] * S, local[:, None, None] * D
    overstress, elastic = memory.overstress, S
    if material.relaxation:
        elastic, elastic_D = material.relaxation.driven(local * energy, S, D)
        overstress, gain = _relaxed(material.relaxation, memory, elastic, instant.interval)
        S, D = S + overstress.sum(axis=0), D + gain * elastic_D
    kept = memory.set
    if material.permanent_set:
        kept = _set(material.permanent_set, memory.set, C, instant.interval)
    return S, D, Memory(peak, kept, elastic, overstress, intact)


def _relaxed(
    relaxation: Relaxation, memory: Memory, S: FloatArray, interval: float
) -> tuple[FloatArray, float]:
    elements, gain = [], 0.0
    for share, time, before in zip(relaxation.shares, relaxation.times, memory.overstress, strict=True):
        ratio = interval / time
        fresh = share * (-np.expm1(-ratio) / ratio if ratio > 0 else 1.0)
        elements.append(np.exp(-ratio) * before + fresh * (S - memory.elastic))
        gain += fresh
    return np.array(elements), gain


def _set(law: PermanentSet, before: FloatArray, C: FloatArray, interval: float) -> FloatArray:
    strain = (C - _UNIT) / 2
    strain = strain - strain[:, :3].mean(axis=1, keepdims=True) * _UNIT
    doubled = np.array([1, 1, 1, 2, 2, 2])
    beyond = np.maximum(np.sqrt(strain**2 @ doubled) - law.yields_at, 0.0)
    share = law.share * (1 + law.per_strain * beyond)
    if law.yields_at:
        share = share * beyond / (beyond + law.yields_at)
    goal = share[:, None] * strain
    grows = (goal**2 @ doubled) > (before**2 @ doubled)
    pace = 1.0 if law.time == 0 else -np.expm1(-interval / law.time)
    return before + pace * np.where(grows[:, None], goal - before, 0.0)


def pseudo_elastic(strength: float, scale: float) -> Softening:
    """1 − strength·tanh((peak − W)/scale) (Ogden and Roxburgh 1999): the virgin curve stays as it is."""

    def factor(energy: FloatArray, peak: FloatArray) -> tuple[FloatArray, FloatArray]:
        gap = np.tanh(np.maximum(peak - energy, 0.0) / scale)
        slope = np.where(peak > energy, strength * (1 - gap**2) / scale, 0.0)
        return 1 - strength * gap, slope

    return factor


def damage(strength: float, scale: float) -> Softening:
    """1 − strength·(1 − exp(−peak/scale)) (Simo 1987; Miehe 1995): the virgin curve bends too."""

    def factor(energy: FloatArray, peak: FloatArray) -> tuple[FloatArray, FloatArray]:
        left = np.exp(-peak / scale)
        slope = np.where(energy >= peak, -strength * left / scale, 0.0)
        return 1 - strength * (1 - left), slope

    return factor
