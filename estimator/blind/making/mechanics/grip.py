"""What lies between the gripper and the tissue that it holds: a spring, or jaws in which the tissue slides.

An offset is where the held tissue stands in the gripper's frame: a translation (m) and a small rotation vector (rad).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# So stiff that the jaws' own elasticity cannot be seen: 1 N gives 1 µm, 1 N·m gives 0.1 mrad.
_RIGID = np.array([1e6, 1e6, 1e6, 1e4, 1e4, 1e4])


# Which share of the offset the tissue at places (n, 3) in the gripper's frame takes; None: all takes all of it.
Evenness = Callable[[FloatArray], FloatArray] | None


class Grip(Protocol):
    """A law of the wrench that returns the held tissue to the gripper, by its offset."""

    @property
    def evenness(self) -> Evenness:
        """Whether some of the held tissue moves less than the rest."""
        ...

    def start(self) -> FloatArray:
        """Return the memory at rest."""
        ...

    def holding(self) -> FloatArray:
        """Return the tangent while nothing slides, (6, 6)."""
        ...

    def __call__(
        self, offset: FloatArray, memory: FloatArray, interval: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the resisting wrench (6,), its tangent (6, 6), and the new memory, after ``interval`` s."""
        ...


@dataclass(frozen=True, slots=True)
class Springs:
    """Elastic jaws, wrist or arm; stiffness in N/m and N·m/rad in the gripper's frame."""

    translation: tuple[float, float, float]
    rotation: tuple[float, float, float]
    evenness: Evenness = None

    def start(self) -> FloatArray:
        """Return an empty memory."""
        return np.zeros(0)

    def holding(self) -> FloatArray:
        """Return the tangent, (6, 6)."""
        return np.diag([*self.translation, *self.rotation])

    def __call__(
        self, offset: FloatArray, memory: FloatArray, interval: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return wrench, tangent and memory, as :class:`Grip` says."""
        stiffness = np.array([*self.translation, *self.rotation])
        return stiffness * offset, np.diag(stiffness), memory


@dataclass(frozen=True, slots=True)
class Jaws:
    """Jaws that hold up to a force and then let the tissue slide, by plastic return mapping.

    Attributes
    ----------
    threshold : force at which it slides, N
    hardening : by which that grows with the slip, N/m
    viscosity : further force by the slip's speed, N·s/m
    evenness : which share of the slip the tissue at a place takes
    """

    threshold: float
    hardening: float
    viscosity: float = 0.0
    evenness: Evenness = None

    def start(self) -> FloatArray:
        """Return the slip (3,) m and its length."""
        return np.zeros(4)

    def holding(self) -> FloatArray:
        """Return the tangent while nothing slides, (6, 6)."""
        return np.diag(_RIGID)

    def __call__(
        self, offset: FloatArray, memory: FloatArray, interval: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return wrench, tangent and memory, as :class:`Grip` says."""
        wrench, tangent = _RIGID * offset, np.diag(_RIGID)
        k = _RIGID[0]
        pull = k * (offset[:3] - memory[:3])
        size = float(np.linalg.norm(pull))
        excess = size - self.threshold - self.hardening * memory[3]
        wrench[:3] = pull
        if excess <= 0:
            return wrench, tangent, memory
        drag = self.viscosity / interval if interval > 0 else 0.0
        slope = self.hardening + drag
        slip = excess / (k + slope)
        direction = pull / size
        along = np.outer(direction, direction)
        wrench[:3] = pull - k * slip * direction
        tangent[:3, :3] = k * (along * slope / (k + slope) + (np.eye(3) - along) * (1 - k * slip / size))
        return wrench, tangent, np.append(memory[:3] + slip * direction, memory[3] + slip)


@dataclass(frozen=True, slots=True)
class Jumping:
    """Jaws that hold, give way by a jump when the force passes a threshold, and hold again.

    Attributes
    ----------
    threshold : N
    jump : m, against the pull
    most : how often they give way at the most
    """

    threshold: float
    jump: float
    evenness: Evenness = None
    most: float = 1.0

    def start(self) -> FloatArray:
        """Return the slip (3,) m, and how often it gave way."""
        return np.zeros(4)

    def holding(self) -> FloatArray:
        """Return the tangent while nothing slides, (6, 6)."""
        return np.diag(_RIGID)

    def __call__(
        self, offset: FloatArray, memory: FloatArray, interval: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return wrench, tangent and memory, as :class:`Grip` says; it slides in the state after the one too strong."""
        wrench = _RIGID * offset
        wrench[:3] -= _RIGID[:3] * memory[:3]
        size = float(np.linalg.norm(wrench[:3]))
        if memory[3] < self.most and size > self.threshold:
            memory = memory + np.append(self.jump * wrench[:3] / size, 1.0)
        return wrench, np.diag(_RIGID), memory
