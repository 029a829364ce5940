"""What an Ethernet Axia is set to, read from its web pages; and the one setting that is changed, the RDT rate.

Unlike a Net F/T box it has one configuration, a calibration for each of its ranges, and a rate of sampling of its own.
Sources: 9610-05-Ethernet Axia-09 and 9620-05-C-Ethernet Axia-02, chapters on the CGI and the XML pages. Where two
spellings of a tag are read, programs of others disagree on it.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from robot_drivers.ati.axia.settings import MAX_RDT_RATE_HZ
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
from robot_drivers.decimal_text import decimal
from robot_drivers.errors import ConfigurationError, DeviceProtocolError
from robot_drivers.specification import Six

SAMPLE_RATES_HZ = (488, 976, 1953, 3906, 7812, 7912)
"""Rates of sampling. The manual's table ends with 7912, twice 3906 is 7812, and the CGI is told to take 7812."""

_RDT_RATE = ("comrdtrate", "commrdtrate")
_SAMPLE_RATE = ("runrate", "setrate")
_FILTER = ("setuserfilter", "setiirshift")


@dataclass(frozen=True, slots=True)
class AxiaConfiguration:
    """What the sensor told; None or empty where it did not.

    Attributes
    ----------
    scaling : units and counts per unit
    product : product name
    calibration, part_number, serial : index of the calibration in force, its name such as "SI-150-8", and its
        serial number
    rated_wrench : its range, ± N and N·m
    sample_rate_hz : at which the sensor samples
    rdt_rate_hz, rdt_buffer_size, rdt_enabled : output rate, records per buffered datagram, whether it streams at all
    low_pass : number of the low-pass filter, 0 for none
    bias : the software bias in force, as told
    """

    scaling: Scaling
    product: str = ""
    calibration: int | None = None
    part_number: str = ""
    serial: str = ""
    rated_wrench: Six | None = None
    sample_rate_hz: int | None = None
    rdt_rate_hz: int | None = None
    rdt_buffer_size: int | None = None
    rdt_enabled: bool | None = None
    low_pass: int | None = None
    bias: str = ""

    def datagram_period_s(self, mode: str) -> float:
        """Return the time between two datagrams of an RDT mode; 0 where the sensor did not tell its rate."""
        if not self.rdt_rate_hz:
            return 0.0
        records = (self.rdt_buffer_size or MAX_RECORDS_PER_DATAGRAM) if mode == "buffered" else 1
        return records / self.rdt_rate_hz


def read_configuration(web: WebPages) -> AxiaConfiguration:
    """Read configuration and calibration in force.

    Raises
    ------
    DeviceUnreachableError, DeviceProtocolError
        No answer, or one that cannot be understood.
    """
    tags = parse_tags(web.page("/netftapi2.xml"), ROOTS_OF_CONFIGURATION)
    calibration = optional_integer(tags, "cfgcalsel")
    page = "/netftcalapi.xml" if calibration is None else f"/netftcalapi.xml?index={calibration}"
    of_calibration = parse_tags(web.page(page), ROOTS_OF_CALIBRATION)
    serial = of_calibration.get("calsn", "")
    if tags.get("cfgcalsn", serial) != serial:
        raise DeviceProtocolError(
            f"the sensor uses calibration {tags['cfgcalsn']!r}, and its calibration page is of {serial!r}: try again"
        )
    told_rate = optional_integer(tags, *_SAMPLE_RATE)
    return AxiaConfiguration(
        scaling=_scaling(tags, "cfg"),
        product=tags.get("prodname", ""),
        calibration=calibration,
        part_number=of_calibration.get("calpn", ""),
        serial=serial,
        rated_wrench=_rated_wrench(of_calibration),
        sample_rate_hz=told_rate if told_rate in SAMPLE_RATES_HZ else None,
        rdt_rate_hz=optional_integer(tags, *_RDT_RATE),
        rdt_buffer_size=optional_integer(tags, "comrdtbsiz"),
        rdt_enabled=enabled(tags, "comrdte"),
        low_pass=optional_integer(tags, *_FILTER),
        bias=tags.get("setbias", ""),
    )


def set_rdt_rate(web: WebPages, rate_hz: int) -> None:
    """Set the RDT output rate (1..7912 Hz) and read it back.

    Raises
    ------
    ConfigurationError
        The rate is out of range, or the sensor kept another one.
    """
    if not 1 <= rate_hz <= MAX_RDT_RATE_HZ:
        raise ConfigurationError(f"RDT rate {rate_hz} Hz: must be 1..{MAX_RDT_RATE_HZ} Hz")
    web.submit(f"/comm.cgi?comrdtrate={rate_hz}")
    kept = optional_integer(parse_tags(web.page("/netftapi2.xml"), ROOTS_OF_CONFIGURATION), *_RDT_RATE)
    if kept != rate_hz:
        raise ConfigurationError(
            f"RDT rate {rate_hz} Hz was requested but the sensor tells {kept}: set it on its Communications page, "
            "and leave rate_hz out"
        )


def _scaling(tags: Mapping[str, str], of: str) -> Scaling:
    """Return units and counts of the configuration (``"cfg"``) or of a calibration (``"cal"``)."""
    units = text(tags, f"s{of}fu"), text(tags, f"s{of}tu")
    return Scaling(*units, number(tags, f"{of}cpf"), number(tags, f"{of}cpt"))


def _rated_wrench(tags: Mapping[str, str]) -> Six | None:
    """Return the range of a calibration in N and N·m; None where its page does not tell it, or not in which units."""
    if not {"calmr", "scalfu", "scaltu"} <= tags.keys():
        return None
    values = [decimal(value) for value in re.split(r"[;,\s]+", tags["calmr"].strip(" ;,"))]
    if len(values) != 6 or not all(math.isfinite(value) and value > 0 for value in values):
        raise DeviceProtocolError(f"the sensor's 'calmr' is {tags['calmr']!r}: must be six positive numbers")
    in_units = Scaling(tags["scalfu"], tags["scaltu"], 1.0, 1.0)
    fx, fy, fz, tx, ty, tz = (in_units.si_per_count * values).tolist()
    return (fx, fy, fz, tx, ty, tz)
