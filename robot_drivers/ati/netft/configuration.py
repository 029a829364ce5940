"""What a Net F/T box is set to, read from its web pages.

A box holds several configurations; counts per unit and units belong to the *active* one. The page without
an index shows configuration 0, and ``netftcalapi.xml`` the factors of the calibration: both are wrong once
a user picked other units. So the index of the active configuration is read first, then its own page.
"""

from dataclasses import replace

from robot_drivers.ati.rdt.configuration import (
    RdtConfiguration,
    calibration_tags,
    configuration_of,
    configuration_tags,
)
from robot_drivers.ati.rdt.tags import optional_integer
from robot_drivers.ati.rdt.web import WebPages
from robot_drivers.errors import ConfigurationError, DeviceProtocolError


def read_configuration(web: WebPages, index: int | None = None) -> RdtConfiguration:
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
    tags = configuration_tags(web, 0)
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
        tags = configuration_tags(web, active)
    if optional_integer(tags, "setcfgsel") not in (None, active):
        raise DeviceProtocolError("the active configuration changed while it was read: try again")
    calibration = optional_integer(tags, "cfgcalsel")
    of_calibration = {} if calibration is None else calibration_tags(web, calibration)
    return replace(configuration_of(tags, of_calibration), index=active, name=tags.get("cfgnam", ""))
