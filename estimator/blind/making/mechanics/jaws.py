"""Further laws of what lies between gripper and tissue: films, grooves, stick-slip, springs that stiffen or creep."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.mechanics.grip import Evenness

FloatArray = NDArray[np.float64]
Answer = tuple[FloatArray, FloatArray, FloatArray]

# So stiff that the jaws' own elasticity cannot be seen, N/m and N·m/rad.
_RIGID = np.array([1e6, 1e6, 1e6, 1e4, 1e4, 1e4])


@dataclass(frozen=True, slots=True)
class Groove:
    """Jaws in which the tissue slides, or turns, along or about one axis alone, by plastic return mapping.

    Attributes
    ----------
    axis : of the gripper; 0 to 2 slides along it, 3 to 5 turns about it
    threshold : N or N·m at which it slides
    hardening : by which that grows, N/m or N·m/rad
    viscosity : N·s/m or N·m·s/rad
    exponent : of the excess in the speed, (excess/viscosity)^exponent; 1 is Newton's, larger a power-law film's
    evenness : which share of the slip the tissue at a place takes
    """

    axis: int
    threshold: float
    hardening: float
    viscosity: float = 0.0
    exponent: float = 1.0
    evenness: Evenness = None

    def start(self) -> FloatArray:
        """Return the slip, and its length."""
        return np.zeros(2)

    def holding(self) -> FloatArray:
        """Return the tangent while nothing slides, (6, 6)."""
        return np.diag(_RIGID)

    def __call__(self, offset: FloatArray, memory: FloatArray, interval: float) -> Answer:
        """Return wrench, tangent and memory, as :class:`~.grip.Grip` says."""
        wrench, tangent = _RIGID * offset, np.diag(_RIGID)
        k = _RIGID[self.axis]
        pull = k * (offset[self.axis] - memory[0])
        wrench[self.axis] = pull
        excess = abs(pull) - self.threshold - self.hardening * memory[1]
        if excess <= 0 or (self.viscosity > 0 and interval <= 0):
            return wrench, tangent, memory
        slip, slope = self._slipped(excess, k, interval)
        wrench[self.axis] = pull - np.sign(pull) * k * slip
        tangent[self.axis, self.axis] = k * (1 - k * slope)
        return wrench, tangent, memory + np.array([np.sign(pull) * slip, slip])

    def _slipped(self, excess: float, k: float, interval: float) -> tuple[float, float]:
        """Return the slip that leaves (k + h) s + η (s/Δt)^(1/n) = excess, and its derivative by the excess."""
        stiffness, root = k + self.hardening, 1 / self.exponent
        if self.viscosity == 0:
            return excess / stiffness, 1 / stiffness
        low, high = 0.0, excess / stiffness
        for _ in range(80):
            slip = (low + high) / 2
            left = stiffness * slip + self.viscosity * (slip / interval) ** root
            low, high = (slip, high) if left < excess else (low, slip)
        grows = stiffness + self.viscosity * root * (slip / interval) ** root / max(slip, 1e-15)
        return slip, 1 / grows


@dataclass(frozen=True)
class Flexure:
    """Elastic jaws, wrist or arm: a stiffness of all directions together, which may change with the deflection.

    The wrench is K q (1 + (|u|/u₀)²), u the translation of q; or, with play, that of q less what lies in the play.

    Attributes
    ----------
    stiffness : K (6, 6), N/m, N·m/rad, in the gripper's frame
    stiffens_at : u₀, m; None: it does not
    play : m of translation before anything bears
    """

    stiffness: FloatArray
    stiffens_at: float | None = None
    play: float = 0.0
    evenness: Evenness = None

    def start(self) -> FloatArray:
        """Return an empty memory."""
        return np.zeros(0)

    def holding(self) -> FloatArray:
        """Return the tangent, (6, 6)."""
        return self.stiffness

    def __call__(self, offset: FloatArray, memory: FloatArray, interval: float) -> Answer:
        """Return wrench, tangent and memory, as :class:`~.grip.Grip` says."""
        u = offset[:3]
        length = float(np.linalg.norm(u))
        if self.stiffens_at is not None:
            factor = 1 + (length / self.stiffens_at) ** 2
            slope = np.concatenate([2 * u / self.stiffens_at**2, np.zeros(3)])
            pushed = self.stiffness @ offset
            tangent = factor * self.stiffness + np.outer(pushed, slope)
            return factor * pushed, tangent, memory
        if not self.play:
            return self.stiffness @ offset, self.stiffness, memory
        # A hundredth bears within the play.
        share = 0.01 if length <= self.play else 1 - 0.99 * self.play / length
        reduced = np.eye(6)
        reduced[:3, :3] *= share
        if length > self.play:
            reduced[:3, :3] += 0.99 * self.play / length**3 * np.outer(u, u)
        left = np.concatenate([share * u, offset[3:]])
        return self.stiffness @ left, self.stiffness @ reduced, memory


@dataclass(frozen=True, slots=True)
class CreepingSprings:
    """Springs with a dashpot each: stiff at first, they yield with a time constant (Kelvin's solid).

    Attributes
    ----------
    translation, rotation : stiffness at once, N/m and N·m/rad
    yields : by how much more they give in the end, as a share of what they give at once
    time : constant, s
    """

    translation: float
    rotation: float
    yields: float
    time: float
    evenness: Evenness = None

    def start(self) -> FloatArray:
        """Return what has crept, (6,)."""
        return np.zeros(6)

    def holding(self) -> FloatArray:
        """Return the tangent at once, (6, 6)."""
        return np.diag(self._stiffness)

    @property
    def _stiffness(self) -> FloatArray:
        return np.array([self.translation] * 3 + [self.rotation] * 3)

    def __call__(self, offset: FloatArray, memory: FloatArray, interval: float) -> Answer:
        """Return wrench, tangent and memory, as :class:`~.grip.Grip` says."""
        pace = interval / self.time
        crept = (memory + pace * self.yields * offset) / (1 + pace * (1 + self.yields))
        slope = 1 - pace * self.yields / (1 + pace * (1 + self.yields))
        return self._stiffness * (offset - crept), np.diag(slope * self._stiffness), crept
