"""The web pages of an emulated sensor on RDT, and the CGI that sets its RDT rate."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from xml.sax.saxutils import escape

from robot_drivers.ati.emulator.box import Box
from robot_drivers.ati.emulator.settings import BoxConfiguration

Tags = Mapping[str, object]

DONE = ""
"""What a page answers that has changed a setting."""


@dataclass(frozen=True, slots=True)
class Pages:
    """What a product tells on its pages.

    Attributes
    ----------
    configuration, calibration : the tags of a page by the index in the request, which is None where it has none; None
        where there is no such page
    fastest_rdt_hz : the fastest RDT rate that its CGI takes
    """

    configuration: Callable[[Box, str | None], Tags | None]
    calibration: Callable[[Box, str | None], Tags | None]
    fastest_rdt_hz: int

    def answer(self, box: Box, path: str, query: Mapping[str, str]) -> str | None:
        """Return a page, :data:`DONE`, or None where there is no such page."""
        index = query.get("index")
        if path == "/netftapi2.xml":
            return _xml("netft", self.configuration(box, index))
        if path == "/netftcalapi.xml":
            return _xml("netftCalibration", self.calibration(box, index))
        if path == "/comm.cgi":
            self._set_rdt_rate(box, query.get("comrdtrate", ""))
            return DONE
        return None

    def _set_rdt_rate(self, box: Box, rate: str) -> None:
        """Take the RDT rate over for the next stream; a value out of range or a misspelt name changes nothing."""
        if rate.isdecimal() and 1 <= int(rate) <= self.fastest_rdt_hz:
            box.rate_hz = int(rate)


def configuration_tags(box: Box, configuration: BoxConfiguration) -> dict[str, object]:
    """Return what the configuration pages of all products tell."""
    return {
        "prodname": box.settings.product,
        "cfgcpf": f"{configuration.counts_per_force:.10g}",
        "cfgcpt": f"{configuration.counts_per_torque:.10g}",
        "scfgfu": configuration.force_unit,
        "scfgtu": configuration.torque_unit,
        "comrdte": "Enabled" if box.settings.rdt_enabled else "Disabled",
        "comrdtrate": box.rate_hz,
        "comrdtbsiz": box.buffer_size,
    }


def calibration_tags(box: Box, counts: tuple[float, float]) -> dict[str, object]:
    """Return what the calibration pages of all products tell; ``counts`` are those per force and torque."""
    per_force, per_torque = counts
    return {"calsn": box.settings.serial, "calcpf": f"{per_force:.10g}", "calcpt": f"{per_torque:.10g}"}


def _xml(root: str, tags: Tags | None) -> str | None:
    """Return a page with one element for each tag."""
    if tags is None:
        return None
    lines = "\n".join(f"  <{tag}>{escape(str(value))}</{tag}>" for tag, value in tags.items())
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<{root}>\n{lines}\n</{root}>\n'
