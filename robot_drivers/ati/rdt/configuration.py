"""What a sensor on RDT is set to, read from its web pages; and the one setting that is changed, the RDT rate.

Sources: 9620-05-Net FT, 9610-05-Ethernet Axia-09 and 9620-05-C-Ethernet Axia-02, chapters on the CGI and the XML
pages. Where two spellings of a tag are read, programs of others disagree on it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from robot_drivers.ati.rdt.protocol import MAX_RECORDS_PER_DATAGRAM
from robot_drivers.ati.rdt.tags import enabled, number, optional_integer, text
from robot_drivers.ati.rdt.web import WebPages, parse_tags
from robot_drivers.ati.transducer.scaling import Scaling
from robot_drivers.errors import ConfigurationError
from robot_drivers.specification import Six

_ROOTS_OF_CONFIGURATION = ("netft", "netFTApi")
_ROOTS_OF_CALIBRATION = ("netftCalibration", "netcal")
_RDT_RATE = ("comrdtrate", "commrdtrate")


@dataclass(frozen=True, slots=True)
class RdtConfiguration:
    """What the sensor told; None or empty where it did not, or where its product has no such thing.

    Attributes
    ----------
    scaling : units and counts per unit in force
    product : product name, e.g. "Net F/T"
    index, name : of the active configuration of a Net F/T box
    calibration, part_number, serial : index of the calibration in force, its name such as "SI-150-8", and its
        serial number, e.g. "FT33206"
    rated_wrench : range of that calibration, ± N and N·m
    sample_rate_hz : at which the sensor samples
    rdt_enabled, rdt_rate_hz, rdt_buffer_size : whether it streams at all, output rate, records per buffered datagram
    low_pass : number of the low-pass filter, 0 for none
    bias : the software bias in force, as told
    """

    scaling: Scaling
    product: str = ""
    index: int | None = None
    name: str = ""
    calibration: int | None = None
    part_number: str = ""
    serial: str = ""
    rated_wrench: Six | None = None
    sample_rate_hz: int | None = None
    rdt_enabled: bool | None = None
    rdt_rate_hz: int | None = None
    rdt_buffer_size: int | None = None
    low_pass: int | None = None
    bias: str = ""

    def datagram_period_s(self, mode: str) -> float:
        """Return the time between two datagrams of an RDT mode; 0 where the sensor did not tell its rate."""
        if not self.rdt_rate_hz:
            return 0.0
        records = (self.rdt_buffer_size or MAX_RECORDS_PER_DATAGRAM) if mode == "buffered" else 1
        return records / self.rdt_rate_hz


def configuration_tags(web: WebPages, index: int | None = None) -> Mapping[str, str]:
    """Return the tags of the configuration page, or of that of one configuration.

    Raises
    ------
    DeviceUnreachableError, DeviceProtocolError
        No answer, or one that cannot be understood.
    """
    return parse_tags(web.page(_indexed("/netftapi2.xml", index)), _ROOTS_OF_CONFIGURATION)


def calibration_tags(web: WebPages, index: int | None) -> Mapping[str, str]:
    """Return the tags of the page of a calibration, of that in force for None.

    Raises
    ------
    DeviceUnreachableError, DeviceProtocolError
        No answer, or one that cannot be understood.
    """
    return parse_tags(web.page(_indexed("/netftcalapi.xml", index)), _ROOTS_OF_CALIBRATION)


def configuration_of(tags: Mapping[str, str], of_calibration: Mapping[str, str]) -> RdtConfiguration:
    """Return what the pages of every product tell alike.

    Raises
    ------
    DeviceProtocolError
        Units or counts are missing, or a number is none.
    """
    return RdtConfiguration(
        scaling=Scaling(
            text(tags, "scfgfu"), text(tags, "scfgtu"), number(tags, "cfgcpf"), number(tags, "cfgcpt")
        ),
        product=tags.get("prodname", ""),
        calibration=optional_integer(tags, "cfgcalsel"),
        part_number=of_calibration.get("calpn", ""),
        serial=of_calibration.get("calsn", ""),
        rdt_enabled=enabled(tags, "comrdte"),
        rdt_rate_hz=optional_integer(tags, *_RDT_RATE),
        rdt_buffer_size=optional_integer(tags, "comrdtbsiz"),
    )


def set_rdt_rate(web: WebPages, rate_hz: int, fastest_hz: int) -> None:
    """Set the RDT output rate, from 1 to ``fastest_hz``, and read it back.

    Raises
    ------
    ConfigurationError
        The rate is out of range, or the sensor kept another one.
    """
    if not 1 <= rate_hz <= fastest_hz:
        raise ConfigurationError(f"RDT rate {rate_hz} Hz: must be 1..{fastest_hz} Hz")
    web.submit(f"/comm.cgi?comrdtrate={rate_hz}")
    kept = optional_integer(configuration_tags(web), *_RDT_RATE)
    if kept != rate_hz:
        raise ConfigurationError(
            f"RDT rate {rate_hz} Hz was requested but the sensor kept {kept}: choose a divisor of the rate at which it "
            "samples, or set the rate on its Communications page and leave rate_hz out"
        )


def _indexed(page: str, index: int | None) -> str:
    return page if index is None else f"{page}?index={index}"
