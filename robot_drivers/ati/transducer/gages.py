"""From raw strain gages to wrenches, for the ATI devices that leave the calibration matrix to the host.

Digital F/T and NETCANOEM send six 16-bit gage readings. Bias is a matter of the gages: it is subtracted before
the matrix (ATI 9610-05-1030, figure 7.1). A gage at the end of its range is broken or overloaded and forbids
using the sample, although every axis may look in range: the gages share each load.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robot_drivers.ati.transducer.gamma import GAGE_MATRIX, RATED_WRENCH
from robot_drivers.ati.transducer.scaling import Scaling
from robot_drivers.errors import DeviceProtocolError
from robot_drivers.protocols import FloatArray

LOWEST_GAGE, HIGHEST_GAGE = -32768, 32767
"""The two ends of a gage's range, where its reading means nothing."""

GAGES_ON_WIRE = (0, 2, 4, 1, 3, 5)
"""The order in which the devices send their gages: even ones first."""

_LARGEST_CONDITION = 1e6
_POSITION_ON_WIRE = np.argsort(GAGES_ON_WIRE)


def from_wire_order(on_wire: NDArray[np.int16]) -> NDArray[np.int32]:
    """Put gages (..., 6) that came in the order of the wire into the order 0..5, in a type that cannot overflow."""
    return on_wire[..., _POSITION_ON_WIRE].astype(np.int32)


@dataclass(frozen=True, slots=True, eq=False)
class GageCalibration:
    """One calibration of a transducer.

    Attributes
    ----------
    matrix : (6, 6) counts of Fx Fy Fz Tx Ty Tz (rows) per count of gages 0..5 (columns)
    scaling : units and counts per unit of what the matrix gives
    rated_wrench : (6,) ± N for Fx Fy Fz and ± N·m for Tx Ty Tz
    serial, part_number : as the device tells, for example ``FT33206`` and ``SI-130-10``
    gains, offsets : (6,) settings of the gage amplifiers that belong to this calibration; empty where the device
        looks after them itself

    Raises
    ------
    DeviceProtocolError
        A matrix that is no calibration: wrong shape, not finite, or singular; or ratings that are not positive.
    """

    matrix: FloatArray
    rated_wrench: tuple[float, ...]
    scaling: Scaling = field(default_factory=Scaling)
    serial: str = ""
    part_number: str = ""
    gains: tuple[int, ...] = ()
    offsets: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        name = f"calibration {self.serial or 'without serial number'}"
        if self.matrix.shape != (6, 6) or not np.isfinite(self.matrix).all():
            raise DeviceProtocolError(
                f"{name}: the matrix must be 6 x 6 finite numbers; check the record read"
            )
        if np.linalg.cond(self.matrix) > _LARGEST_CONDITION:
            raise DeviceProtocolError(f"{name}: the matrix is singular, as in an empty slot; choose another")
        if len(self.rated_wrench) != 6 or not all(0 < rating < np.inf for rating in self.rated_wrench):
            raise DeviceProtocolError(f"{name}: ratings {self.rated_wrench} must be six positive numbers")

    @property
    def si_per_gage(self) -> FloatArray:
        """The matrix in SI, (6, 6): N and N·m per gage count."""
        return self.scaling.si_per_count[:, np.newaxis] * self.matrix

    def wrench(self, gages: ArrayLike, bias: ArrayLike = 0) -> FloatArray:
        """Return the wrench (..., 6), N and N·m, of gages (..., 6); ``bias`` (6,) is their mean without load."""
        return np.subtract(gages, bias, dtype=np.float64) @ self.si_per_gage.T

    def gages(self, wrench: ArrayLike) -> FloatArray:
        """Return the gages (..., 6) that a wrench (..., 6), N and N·m, moves, in counts from no load."""
        return np.asarray(wrench, np.float64) @ np.linalg.inv(self.si_per_gage).T

    def in_range(self, wrench: FloatArray) -> NDArray[np.bool_]:
        """Tell for each wrench (..., 6), N and N·m, whether every axis is within its rating."""
        return np.logical_and.reduce(np.abs(wrench) <= self.rated_wrench, axis=-1)

    def saturation_margin(self, wrench: ArrayLike, bias: ArrayLike = 0) -> FloatArray:
        """Return the share of the gage range that a wrench (..., 6) leaves free in the most loaded gage.

        Below 0 the load would saturate a gage. This can happen with every axis within its rating, when several
        are loaded together. ``bias`` (6,) are the gages without load.
        """
        return 1 - np.abs(self.gages(wrench) + np.asarray(bias)).max(axis=-1) / HIGHEST_GAGE


def saturated(gages: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Tell for each sample of gages (..., 6) whether one is at the end of its range."""
    return np.logical_or.reduce((gages <= LOWEST_GAGE) | (gages >= HIGHEST_GAGE), axis=-1)


FT33206 = GageCalibration(
    matrix=GAGE_MATRIX,
    rated_wrench=RATED_WRENCH,
    serial="FT33206",
    part_number="SI-130-10",
    gains=(543, 555, 569, 579, 565, 567),
    offsets=(34927, 33031, 32120, 32868, 32234, 31842),
)
"""The calibration of a real Gamma, for emulators and trials; a device in use tells its own."""
