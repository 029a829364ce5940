"""The bytes of an ATI Digital F/T (RS-485): registers, calibration record, stream, status word.

Source: ATI 9620-05-Digital FT, chapter 8, as two independent open-source drivers render it; the manual itself was
not at hand. Where only one of them tells, the text says so.
"""

import struct

import numpy as np
from numpy.typing import NDArray

from robot_drivers.ati.serial.framing import ByteArray, FrameSynchroniser, Records
from robot_drivers.ati.transducer.gages import GageCalibration, from_wire_order
from robot_drivers.ati.transducer.scaling import FORCE_UNIT_BY_CODE, TORQUE_UNIT_BY_CODE, Scaling
from robot_drivers.ati.transducer.status import StatusMap
from robot_drivers.errors import DeviceProtocolError

GAINS_REGISTER, OFFSETS_REGISTER, STATUS_REGISTER = 0x0000, 0x0006, 0x001D
MAX_CALIBRATIONS = 16
CALIBRATION_REGISTERS = 168
_CALIBRATION_BASE, _CALIBRATION_STRIDE = 0x00E3, 192  # the stride is told by one driver only

START_STREAMING, START_VALUE = 0x46, 0x55
STORAGE_LOCK, UNLOCK_VALUE, LOCK_VALUE = 0x6A, 0xAA, 0x18

JAM = bytes(range(1, 15))
"""What ends a stream; at least 14 bytes of any value."""

SAMPLE_SIZE = 13
_CHECKED_BYTES = 12

_RECORD = struct.Struct(">8s32s4s20s36fBB6fii6H6H")
"""The calibration record as far as its fields are known (133 registers); one driver tells the layout."""

STATUS_MAP = StatusMap(
    "Digital F/T",
    {
        0: "restarted by its watchdog",
        1: "gage excitation voltage too high",
        2: "gage excitation voltage too low",
        3: "artificial analog ground out of range",
        4: "supply voltage too high",
        5: "supply voltage too low",
        7: "EEPROM failure",
        8: "configuration invalid, defaults in use",
        9: "gage supply current too high",
        10: "gage supply current too low",
        11: "thermistor too high",
        12: "thermistor too low",
        13: "DAC reading out of range",
    },
    usable_words=(0,),
)
"""The status word in register 0x001D (told by one driver)."""


def calibration_register(index: int) -> int:
    """Return the first register of calibration 1..16."""
    return _CALIBRATION_BASE + _CALIBRATION_STRIDE * (index - 1)


def parse_calibration(record: bytes) -> GageCalibration:
    """Decode a calibration record, of which at least the known part is given.

    Raises
    ------
    DeviceProtocolError
        The record is too short, or is no calibration, as in an empty slot.
    """
    if len(record) < _RECORD.size:
        raise DeviceProtocolError(
            f"calibration record of {len(record)} bytes: at least {_RECORD.size} are needed"
        )
    serial, part_number, _family, _time, *numbers = _RECORD.unpack_from(record)
    matrix, (force_code, torque_code), ratings = numbers[:36], numbers[36:38], numbers[38:44]
    per_force, per_torque = numbers[44:46]
    if force_code not in FORCE_UNIT_BY_CODE or torque_code not in TORQUE_UNIT_BY_CODE:
        raise DeviceProtocolError(
            f"calibration record with unknown unit codes {force_code}, {torque_code}: "
            "the slot may be empty; choose another calibration_index"
        )
    scaling = Scaling(FORCE_UNIT_BY_CODE[force_code], TORQUE_UNIT_BY_CODE[torque_code], per_force, per_torque)
    counts_per_unit = np.repeat([per_force, per_torque], 3)
    return GageCalibration(
        matrix=np.array(matrix).reshape(6, 6),
        rated_wrench=tuple((np.array(ratings) * counts_per_unit * scaling.si_per_count).tolist()),
        scaling=scaling,
        serial=_text(serial),
        part_number=_text(part_number),
        gains=tuple(numbers[46:52]),
        offsets=tuple(numbers[52:58]),
    )


def _text(field: bytes) -> str:
    return field.split(b"\0")[0].decode("ascii", "replace").strip()


def checksum_holds(samples: ByteArray) -> NDArray[np.bool_]:
    """Tell for byte strings (n, 13) whether the last seven bits are the sum of the first twelve bytes.

    It sees every change of one byte but for that of its top bit.
    """
    total = samples[:, :_CHECKED_BYTES].sum(axis=1, dtype=np.uint16)
    return (total ^ samples[:, _CHECKED_BYTES]) & 0x7F == 0


class SampleDecoder:
    """Finds the samples of a stream that begins with a whole one: values are gages 0..5, status 1 is an error."""

    record_size = SAMPLE_SIZE

    def __init__(self) -> None:
        self._frames = FrameSynchroniser(SAMPLE_SIZE, checksum_holds)

    @property
    def damages(self) -> int:
        """How often the sequence of good samples was interrupted."""
        return self._frames.damages

    def feed(self, data: bytes) -> Records:
        """Take the next bytes; return the samples that have become certain."""
        frames = self._frames.feed(data)
        content = frames.content
        on_wire = np.ascontiguousarray(content[:, :_CHECKED_BYTES]).view(">i2")
        return Records(
            status=(content[:, _CHECKED_BYTES] >> 7).astype(np.int64),
            values=from_wire_order(on_wire),
            index=frames.index,
            end=frames.end,
        )
