"""What pulls on outer faces: elastic layers, adhesive that fails, and friction."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.mechanics.brick_mesh import Face
from estimator.blind.making.mechanics.response import Instant

FloatArray = NDArray[np.float64]


class Traction(Protocol):
    """A law of the traction that resists displacement of a face."""

    def start(self, count: int) -> FloatArray:
        """Return the memory of ``count`` points, (n, anything)."""
        ...

    def __call__(
        self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return tractions (n, 3) Pa that resist u (n, 3) m, their tangents (n, 3, 3) Pa/m, and the new memory."""
        ...


@dataclass(frozen=True, slots=True)
class Layer:
    """An elastic layer.

    Attributes
    ----------
    axis : its normal, 0 to 2
    normal, tangential : stiffness, Pa/m
    softer : the stiffness falls by this share from one end of the face to the other
    along : the axis of that
    reach : half the length of the face along it, m
    """

    axis: int
    normal: float
    tangential: float
    softer: float = 0.0
    along: int = 1
    reach: float = 0.05

    def start(self, count: int) -> FloatArray:
        """Return an empty memory."""
        return np.zeros((count, 0))

    def __call__(
        self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return traction, tangent and memory, as :class:`Traction` says."""
        stiffness = np.full(3, self.tangential)
        stiffness[self.axis] = self.normal
        local = 1 - self.softer * (1 + points[:, self.along] / self.reach) / 2
        tangent = local[:, None, None] * np.diag(stiffness)
        return local[:, None] * stiffness * u, tangent, memory


@dataclass(frozen=True, slots=True)
class Glue:
    """A stiff layer that lets go for good where its traction passes a strength; it lets go over a small opening.

    Attributes
    ----------
    stiffness : before it fails, Pa/m
    strength : Pa
    weak_end, reach : the strength is this share of it at y = −reach, m, and rises linearly to 1 at y = 0
    """

    stiffness: float
    strength: float
    weak_end: float = 1.0
    reach: float = 0.05

    def start(self, count: int) -> FloatArray:
        """Return the share that holds, (n, 1)."""
        return np.ones((count, 1))

    def __call__(
        self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return traction, tangent and memory, as :class:`Traction` says."""
        strength = self.strength * np.clip(
            1 + (1 - self.weak_end) * points[:, 1] / self.reach, self.weak_end, 1.0
        )
        onset = strength / self.stiffness
        opening = np.linalg.norm(u, axis=1)
        # From onset to three times it, the traction falls linearly to nothing.
        left = onset * (3 * onset - opening) / np.maximum(2 * onset * opening, 1e-15)
        left = np.where(opening > onset, np.clip(left, 0.0, 1.0), 1.0)
        # What fails in a state is missing from the next: the tangent stays positive definite.
        stiffness = self.stiffness * np.maximum(memory[:, 0], 1e-4)
        tangent = stiffness[:, None, None] * np.eye(3)
        return stiffness[:, None] * u, tangent, np.minimum(memory, left[:, None])


@dataclass(frozen=True, slots=True)
class Friction:
    """Dry friction on the table below: elastic up to a small slip, then sliding.

    Attributes
    ----------
    limit : shear traction at which it slides, Pa
    elastic_slip : how far it yields before, m
    lift : where the tissue is lifted by more than this, it does not rub, m; None: it always does
    """

    limit: float
    elastic_slip: float = 2e-4
    lift: float | None = None

    def start(self, count: int) -> FloatArray:
        """Return where the sliders stand, (n, 2) m."""
        return np.zeros((count, 2))

    def __call__(
        self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return traction, tangent and memory, as :class:`Traction` says."""
        limit = np.full(len(u), self.limit)
        if self.lift is not None:
            limit = limit * np.clip(1 - u[:, 2] / self.lift, 0.0, 1.0)
        stiffness = limit / self.elastic_slip
        stretch = u[:, :2] - memory
        length = np.linalg.norm(stretch, axis=1)
        sliding = length > self.elastic_slip
        direction = stretch / np.maximum(length, 1e-15)[:, None]
        held = np.where(sliding, self.elastic_slip / np.maximum(length, 1e-15), 1.0)
        traction = np.zeros((len(u), 3))
        traction[:, :2] = (stiffness * held)[:, None] * stretch
        tangent = np.zeros((len(u), 3, 3))
        across = np.eye(2) - sliding[:, None, None] * direction[:, :, None] * direction[:, None, :]
        tangent[:, :2, :2] = (stiffness * held)[:, None, None] * across
        return traction, tangent, u[:, :2] - held[:, None] * stretch


@dataclass(frozen=True, slots=True)
class _Disc:
    """What remembers nothing and acts inside a disc.

    Attributes
    ----------
    centre : x, y, m
    radius : m
    stiffness : by how much the traction grows with the displacement, Pa/m
    """

    centre: tuple[float, float]
    radius: float
    stiffness: float

    def start(self, count: int) -> FloatArray:
        """Return an empty memory."""
        return np.zeros((count, 0))

    def holds(self, points: FloatArray) -> NDArray[np.bool_]:
        """Tell which points (n, 3) lie inside."""
        return np.asarray(np.linalg.norm(points[:, :2] - self.centre, axis=1) < self.radius)


@dataclass(frozen=True, slots=True)
class Patch(_Disc):
    """Tissue that sticks elastically to the table inside a disc, in every direction."""

    def __call__(
        self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return traction, tangent and memory, as :class:`Traction` says."""
        stiffness = np.where(self.holds(points), self.stiffness, 0.0)
        return stiffness[:, None] * u, stiffness[:, None, None] * np.eye(3), memory


@dataclass(frozen=True, slots=True)
class Pocket(_Disc):
    """Air caught under the tissue: it pushes up inside a disc, the less the higher the tissue is.

    Attributes
    ----------
    height : at which its pressure is gone, m
    """

    height: float

    def __call__(
        self, points: FloatArray, u: FloatArray, memory: FloatArray, instant: Instant
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return traction, tangent and memory, as :class:`Traction` says."""
        stiffness = np.where(self.holds(points) & (u[:, 2] < self.height), self.stiffness, 0.0)
        traction, tangent = np.zeros((len(u), 3)), np.zeros((len(u), 3, 3))
        traction[:, 2] = stiffness * (u[:, 2] - self.height)
        tangent[:, 2, 2] = stiffness
        return traction, tangent, memory


@dataclass(frozen=True, slots=True)
class LoadedFace:
    """A face and the law of its traction."""

    face: Face
    traction: Traction

    def loads(
        self, u_cells: FloatArray, memory: FloatArray, instant: Instant
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return nodal forces (k, 60) N and tangents (k, 60, 60) N/m of the face's cells, and the new memory.

        ``u_cells`` (k, 20, 3) m are the displacements of those cells.
        """
        shapes, areas = self.face.shapes, self.face.areas
        k, q = areas.shape
        u = np.einsum("qn,kni->kqi", shapes, u_cells)
        t, tangent, memory = self.traction(self.face.points.reshape(-1, 3), u.reshape(-1, 3), memory, instant)
        forces = np.einsum("kqi,kq,qn->kni", t.reshape(k, q, 3), areas, shapes)
        stiffness = np.einsum(
            "kqij,kq,qn,qm->knimj", tangent.reshape(k, q, 3, 3), areas, shapes, shapes, optimize=True
        )
        return forces.reshape(k, 60), stiffness.reshape(k, 60, 60), memory
