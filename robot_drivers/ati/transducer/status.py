"""Status words: which of them forbid using a sample, and what to tell an operator.

The Net F/T box and the Ethernet Axia use the same 32-bit word with different meanings, so the map is chosen
by the product name. The Net F/T bits come from one family of open-source drivers and wait for confirmation by
the manual (9620-05-Net FT, section 18.2); a laboratory that knows better states its own usable words. Those of the
Axia are of its manual (9610-05-Ethernet Axia-09, tables 4.7 and 4.9; 9620-05-C-Ethernet Axia-02, table 5.7).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robot_drivers.protocols import IntArray


@dataclass(frozen=True, slots=True)
class StatusMap:
    """The meaning of one product's status word.

    Attributes
    ----------
    product : name of the product
    words : meaning of each bit, by bit number
    usable_words : status words with which a sample may be used; every other word forbids it
    """

    product: str
    words: Mapping[int, str]
    usable_words: tuple[int, ...]

    def usable(self, status: IntArray) -> NDArray[np.bool_]:
        """Tell for each status word, (n,) int64, whether its sample may be used."""
        if not status.any():
            return np.ones(status.shape, np.bool_)
        return np.isin(status, self.usable_words)

    def with_usable(self, words: tuple[int, ...] | None) -> "StatusMap":
        """Return the map with these words for the usable ones; None leaves its own."""
        return self if words is None else replace(self, usable_words=words)

    def describe(self, status: int) -> tuple[str, ...]:
        """Return one line for each bit that is set, highest first; empty for a healthy sensor."""
        return describe(status, self.words)


def describe(status: int, words: Mapping[int, str]) -> tuple[str, ...]:
    """Return one line for each bit that is set in a status word of up to 32 bits, highest first."""
    return tuple(
        f"bit {bit}: {words.get(bit, 'not documented')}" for bit in range(31, -1, -1) if status >> bit & 1
    )


NET_FT = StatusMap(
    "Net F/T",
    {
        31: "summary: another bit is set",
        30: "CPU or RAM failure",
        29: "digital board failure",
        28: "analog board failure",
        27: "serial link between the boards failed",
        26: "program memory failed verification",
        25: "halted because of configuration errors",
        24: "settings failed validation",
        23: "configuration does not fit the calibration",
        22: "network communication error",
        21: "CAN communication error",
        20: "RDT communication error",
        19: "EtherNet/IP protocol error",
        18: "DeviceNet protocol error",
        17: "transducer saturated or A/D error: the data are not usable",
        16: "monitor condition latched (a warning)",
        14: "watchdog timeout",
        13: "stack check failed",
        12: "serial EEPROM (I2C) failure",
        11: "serial flash (SPI) failure",
        10: "analog board watchdog timeout",
        9: "gage excitation current too high",
        8: "gage excitation current too low",
        7: "artificial analog ground out of range",
        6: "analog board supply too high",
        5: "analog board supply too low",
        4: "serial link data unavailable",
        3: "reference voltage or power monitor error",
        2: "internal temperature error",
        1: "HTTP protocol error",
    },
    # The latch counts as a warning only together with the summary bit; alone it contradicts itself.
    usable_words=(0, 0x8001_0000),
)

AXIA = StatusMap(
    "Ethernet Axia",
    {
        31: "some error bit is set",
        30: "force or torque out of range",
        29: "calibration checksum error",
        28: "simulated error, which somebody switched on for a trial",
        27: "gage out of range",
        16: "monitor condition latched (a warning)",
        7: "calibration not accessible",
        5: "another error",
        3: "busy: a change of filter, calibration or rate may affect the data (not an error)",
        2: "broken gage: its connection is open",
        1: "supply voltage out of range",
        0: "temperature out of range",
    },
    # Busy is no error, but the manual says that it may affect the data. A latch is none either, and so comes without
    # the summary bit; with it as well, should a firmware take that for one.
    usable_words=(0, 0x0001_0000, 0x8001_0000),
)

STATUS_MAPS: Mapping[str, StatusMap] = {"net-ft": NET_FT, "axia": AXIA}


def status_map(product: str) -> StatusMap:
    """Choose the map by the product name that the device tells; anything but an Axia is a Net F/T box."""
    return AXIA if "axia" in product.lower() else NET_FT
