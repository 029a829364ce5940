"""What an Ethernet Axia is set to, read from its web pages.

Unlike a Net F/T box it has one configuration, a calibration for each of its ranges, and a rate of sampling of its own.
Sources: 9610-05-Ethernet Axia-09 and 9620-05-C-Ethernet Axia-02, chapters on the CGI and the XML pages. Where two
spellings of a tag are read, programs of others disagree on it.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import replace

from robot_drivers.ati.rdt.configuration import (
    RdtConfiguration,
    calibration_tags,
    configuration_of,
    configuration_tags,
)
from robot_drivers.ati.rdt.tags import optional_integer
from robot_drivers.ati.rdt.web import WebPages
from robot_drivers.ati.transducer.scaling import Scaling
from robot_drivers.decimal_text import decimal
from robot_drivers.errors import DeviceProtocolError
from robot_drivers.specification import Six

SAMPLE_RATES_HZ = (488, 976, 1953, 3906, 7812, 7912)
"""Rates of sampling. The manual's table ends with 7912, twice 3906 is 7812, and the CGI is told to take 7812."""

_SAMPLE_RATE = ("runrate", "setrate")
_FILTER = ("setuserfilter", "setiirshift")


def read_configuration(web: WebPages) -> RdtConfiguration:
    """Read configuration and calibration in force.

    Raises
    ------
    DeviceUnreachableError, DeviceProtocolError
        No answer, or one that cannot be understood.
    """
    tags = configuration_tags(web)
    of_calibration = calibration_tags(web, optional_integer(tags, "cfgcalsel"))
    told = configuration_of(tags, of_calibration)
    if tags.get("cfgcalsn", told.serial) != told.serial:
        raise DeviceProtocolError(
            f"the sensor uses calibration {tags['cfgcalsn']!r}, and its calibration page is of {told.serial!r}: "
            "try again"
        )
    told_rate = optional_integer(tags, *_SAMPLE_RATE)
    return replace(
        told,
        rated_wrench=_rated_wrench(of_calibration),
        sample_rate_hz=told_rate if told_rate in SAMPLE_RATES_HZ else None,
        low_pass=optional_integer(tags, *_FILTER),
        bias=tags.get("setbias", ""),
    )


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
