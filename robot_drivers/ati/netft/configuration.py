"""What a Net F/T box is set to, read from its web pages; and the one setting that is changed, the RDT rate.

A box holds several configurations; counts per unit and units belong to the *active* one. The page without
an index shows configuration 0, and ``netftcalapi.xml`` the factors of the calibration: both are wrong once
a user picked other units. So the index of the active configuration is read first, then its own page.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from robot_drivers.ati.netft.rdt import MAX_RECORDS_PER_DATAGRAM
from robot_drivers.ati.netft.tags import (
    ROOTS_OF_CALIBRATION,
    ROOTS_OF_CONFIGURATION,
    enabled,
    number,
    optional_integer,
    text,
)
from robot_drivers.ati.netft.web import WebPages, parse_tags
from robot_drivers.ati.transducer.scaling import Scaling
from robot_drivers.errors import ConfigurationError, DeviceProtocolError

MAX_RDT_RATE_HZ = 7000


@dataclass(frozen=True, slots=True)
class NetFTConfiguration:
    """What the box told; None or empty where it did not.

    Attributes
    ----------
    scaling : units and counts per unit of the active configuration
    product : product name, e.g. "Net F/T"
    index, name : of the active configuration
    calibration_serial : serial number of the calibrated transducer, e.g. "FT33206"
    rdt_enabled : whether the box streams at all
    rdt_rate_hz : output rate
    rdt_buffer_size : records per datagram in buffered mode
    """

    scaling: Scaling
    product: str = ""
    index: int | None = None
    name: str = ""
    calibration_serial: str = ""
    rdt_enabled: bool | None = None
    rdt_rate_hz: int | None = None
    rdt_buffer_size: int | None = None

    def datagram_period_s(self, mode: str) -> float:
        """Return the time between two datagrams of an RDT mode; 0 where the box did not tell its rate."""
        if not self.rdt_rate_hz:
            return 0.0
        records = MAX_RECORDS_PER_DATAGRAM if mode == "buffered" else 1
        if mode == "buffered" and self.rdt_buffer_size:
            records = self.rdt_buffer_size
        return records / self.rdt_rate_hz


def read_configuration(web: WebPages, index: int | None = None) -> NetFTConfiguration:
    """Read the active configuration.

    Parameters
    ----------
    web : pages of the box
    index : the configuration known to be active, for a box that does not tell

    Raises
    ------
    DeviceUnreachableError, DeviceProtocolError
        No answer, or one that cannot be understood.
    ConfigurationError
        The box does not tell its active configuration, or tells another one than ``index``.
    """
    tags = _read_tags(web, "/netftapi2.xml?index=0")
    active = optional_integer(tags, "setcfgsel")
    if active is None:
        active = index
    if active is None:
        raise ConfigurationError(
            "the sensor does not tell which configuration is active (no setcfgsel): set configuration_index"
        )
    if index is not None and index != active:
        raise ConfigurationError(
            f"configuration {index} is expected to be active but the sensor uses {active}: "
            "change configuration_index, or the sensor's Settings page"
        )
    if active != 0:
        tags = _read_tags(web, f"/netftapi2.xml?index={active}")
    if optional_integer(tags, "setcfgsel") not in (None, active):
        raise DeviceProtocolError("the active configuration changed while it was read: try again")
    return NetFTConfiguration(
        scaling=Scaling(
            text(tags, "scfgfu"), text(tags, "scfgtu"), number(tags, "cfgcpf"), number(tags, "cfgcpt")
        ),
        product=tags.get("prodname", ""),
        index=active,
        name=tags.get("cfgnam", ""),
        calibration_serial=_calibration_serial(web, tags),
        rdt_enabled=enabled(tags, "comrdte"),
        rdt_rate_hz=optional_integer(tags, "comrdtrate"),
        rdt_buffer_size=optional_integer(tags, "comrdtbsiz"),
    )


def set_rdt_rate(web: WebPages, rate_hz: int) -> None:
    """Set the RDT output rate (1..7000 Hz) and read it back.

    Raises
    ------
    ConfigurationError
        The rate is out of range, or the box kept another one.
    """
    if not 1 <= rate_hz <= MAX_RDT_RATE_HZ:
        raise ConfigurationError(f"RDT rate {rate_hz} Hz: must be 1..{MAX_RDT_RATE_HZ} Hz")
    web.submit(f"/comm.cgi?comrdtrate={rate_hz}")
    kept = optional_integer(_read_tags(web, "/netftapi2.xml"), "comrdtrate")
    if kept != rate_hz:
        raise ConfigurationError(
            f"RDT rate {rate_hz} Hz was requested but the sensor kept {kept}: "
            "choose a divisor of its internal rate, or set it on the Communications page"
        )


def _read_tags(web: WebPages, path: str) -> Mapping[str, str]:
    return parse_tags(web.page(path), ROOTS_OF_CONFIGURATION)


def _calibration_serial(web: WebPages, tags: Mapping[str, str]) -> str:
    calibration = optional_integer(tags, "cfgcalsel")
    if calibration is None:
        return ""
    page = web.page(f"/netftcalapi.xml?index={calibration}")
    return parse_tags(page, ROOTS_OF_CALIBRATION).get("calsn", "")
