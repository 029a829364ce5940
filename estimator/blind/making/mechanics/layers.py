"""Further laws of the traction on outer faces: layers that stiffen, creep or peel, films, and adhesion that breaks."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.mechanics.response import Instant

FloatArray = NDArray[np.float64]
# Of places (n, 3) m: a factor (n,).
OverFace = Callable[[FloatArray], FloatArray]
Loads = tuple[FloatArray, FloatArray, FloatArray]


def everywhere(points: FloatArray) -> FloatArray:
    """Return one at all places (n, 3)."""
    return np.ones(len(points))


@dataclass(frozen=True, slots=True)
class Springs:
    """An elastic layer of uneven stiffness, which may stiffen with its opening, or bear nothing before some slack.

    The traction is k u (1 + (|u|/u₀)²), or k (|u| − slack) along u where that is positive.

    Attributes
    ----------
    axis : of the normal, 0 to 2
    normal, tangential : k, Pa/m
    local : factor of k by the place
    stiffens_at : u₀, m; None: it does not
    slack : m; before it a hundredth of k bears
    """

    axis: int
    normal: float
    tangential: float
    local: OverFace = everywhere
    stiffens_at: float | None = None
    slack: float = 0.0

    def start(self, count: int) -> FloatArray:
        """Return an empty memory."""
        return np.zeros((count, 0))

    def __call__(self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant) -> Loads:
        """Return traction, tangent and memory, as :class:`~.surfaces.Traction` says."""
        stiffness = np.full(3, self.tangential)
        stiffness[self.axis] = self.normal
        k = self.local(points)[:, None] * stiffness
        length = np.linalg.norm(u, axis=1)
        factor, slope = np.ones(len(u)), np.zeros(len(u))
        if self.stiffens_at is not None:
            factor, slope = 1 + (length / self.stiffens_at) ** 2, 2 * length / self.stiffens_at**2
        if self.slack:
            safe = np.maximum(length, 1e-12)
            taut = length > self.slack
            factor = np.where(taut, 1 - 0.99 * self.slack / safe, 0.01)
            slope = np.where(taut, 0.99 * self.slack / safe**2, 0.0)
        direction = u / np.maximum(length, 1e-12)[:, None]
        tangent = factor[:, None, None] * (k[:, :, None] * np.eye(3))
        # Symmetric where k is alike in all directions, and nearly so where not.
        tangent = tangent + _symmetric(slope[:, None, None] * (k * u)[:, :, None] * direction[:, None, :])
        return factor[:, None] * k * u, tangent, memory


@dataclass(frozen=True, slots=True)
class Creeping:
    """A layer with a dashpot: stiff at first, it yields with a time constant towards a softer one (Kelvin's solid).

    Attributes
    ----------
    stiffness : at once, Pa/m
    yields : by how much more it gives in the end, as a share of what it gives at once
    time : constant, s
    """

    stiffness: float
    yields: float
    time: float

    def start(self, count: int) -> FloatArray:
        """Return what has crept, (n, 3) m."""
        return np.zeros((count, 3))

    def __call__(self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant) -> Loads:
        """Return traction, tangent and memory, as :class:`~.surfaces.Traction` says."""
        # Backward Euler of dv/dt = (yields (u − v) − v) / time for what has crept, v.
        pace = instant.interval / self.time
        crept = (memory + pace * self.yields * u) / (1 + pace * (1 + self.yields))
        slope = 1 - pace * self.yields / (1 + pace * (1 + self.yields))
        traction = self.stiffness * (u - crept)
        return traction, np.broadcast_to(self.stiffness * slope * np.eye(3), (len(u), 3, 3)), crept


@dataclass(frozen=True, slots=True)
class Peeling:
    """A stiff layer of which ever more is off: where a front has passed by, nothing holds any more.

    Attributes
    ----------
    stiffness : before it is off, Pa/m
    passed : tells for places (n, 3) and an instant what the front has passed by
    """

    stiffness: float
    passed: Callable[[FloatArray, Instant], NDArray[np.bool_]]

    def start(self, count: int) -> FloatArray:
        """Return the share that holds, (n, 1)."""
        return np.ones((count, 1))

    def __call__(self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant) -> Loads:
        """Return traction, tangent and memory, as :class:`~.surfaces.Traction` says."""
        left = np.where(self.passed(points, instant), 0.0, memory[:, 0])
        stiffness = self.stiffness * np.maximum(left, 1e-4)
        return stiffness[:, None] * u, stiffness[:, None, None] * np.eye(3), left[:, None]


@dataclass(frozen=True, slots=True)
class Film:
    """A viscous film on the table: shear traction in proportion to the speed.

    Attributes
    ----------
    drag : Pa s/m
    local : factor by the place
    """

    drag: float
    local: OverFace = everywhere

    def start(self, count: int) -> FloatArray:
        """Return where the tissue was, (n, 2) m."""
        return np.zeros((count, 2))

    def __call__(self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant) -> Loads:
        """Return traction, tangent and memory, as :class:`~.surfaces.Traction` says."""
        traction, tangent = np.zeros((len(u), 3)), np.zeros((len(u), 3, 3))
        if instant.interval <= 0:
            return traction, tangent, u[:, :2].copy()
        rate = self.drag * self.local(points) / instant.interval
        traction[:, :2] = rate[:, None] * (u[:, :2] - memory)
        tangent[:, [0, 1], [0, 1]] = rate[:, None]
        return traction, tangent, u[:, :2].copy()


@dataclass(frozen=True, slots=True)
class Rubbing:
    """Dry friction whose limit depends on the place and falls once it slides (static and kinetic; Stribeck 1902).

    Attributes
    ----------
    limit : shear traction at which it goes on sliding, Pa
    sticks : factor of that before it has slid at all
    local : factor by the place
    elastic_slip : how far it yields before, m
    breaks : what has slid bears nothing any more: adhesion that does not come back
    """

    limit: float
    sticks: float = 1.0
    local: OverFace = everywhere
    elastic_slip: float = 2e-4
    breaks: bool = False

    def start(self, count: int) -> FloatArray:
        """Return where the sliders stand, (n, 2) m, and whether they have slid."""
        return np.zeros((count, 3))

    def __call__(self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant) -> Loads:
        """Return traction, tangent and memory, as :class:`~.surfaces.Traction` says."""
        slid = memory[:, 2] > 0
        stiffness = self.limit * self.local(points) / self.elastic_slip
        reach = np.where(slid, 1.0, self.sticks) * self.elastic_slip
        if self.breaks:
            stiffness = np.where(slid, 1e-4 * stiffness, stiffness)
        stretch = u[:, :2] - memory[:, :2]
        length = np.maximum(np.linalg.norm(stretch, axis=1), 1e-15)
        sliding = length > reach
        held = np.where(sliding, reach / length, 1.0)
        traction, tangent = np.zeros((len(u), 3)), np.zeros((len(u), 3, 3))
        traction[:, :2] = (stiffness * held)[:, None] * stretch
        direction = stretch / length[:, None]
        across = np.eye(2) - sliding[:, None, None] * direction[:, :, None] * direction[:, None, :]
        tangent[:, :2, :2] = (stiffness * held)[:, None, None] * across
        stands = u[:, :2] - held[:, None] * stretch
        return traction, tangent, np.column_stack([stands, np.maximum(memory[:, 2], sliding)])


@dataclass(frozen=True, slots=True)
class Foam:
    """A soft bed below the tissue that pushes it up in proportion to how far it sinks, and never draws.

    Attributes
    ----------
    stiffness : Pa/m
    """

    stiffness: float

    def start(self, count: int) -> FloatArray:
        """Return an empty memory."""
        return np.zeros((count, 0))

    def __call__(self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant) -> Loads:
        """Return traction, tangent and memory, as :class:`~.surfaces.Traction` says."""
        # What has lifted keeps a hundredth, so that Newton's steps find back.
        stiffness = np.where(u[:, 2] < 0, self.stiffness, 0.01 * self.stiffness)
        traction, tangent = np.zeros((len(u), 3)), np.zeros((len(u), 3, 3))
        traction[:, 2] = stiffness * u[:, 2]
        tangent[:, 2, 2] = stiffness
        return traction, tangent, memory


def _symmetric(tensors: FloatArray) -> FloatArray:
    return (tensors + np.swapaxes(tensors, 1, 2)) / 2
