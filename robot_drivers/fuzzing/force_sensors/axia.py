"""Fuzz target: the web pages of an Ethernet Axia."""

import math
import re
from random import Random
from xml.dom import expatbuilder

from robot_drivers.ati.axia.configuration import SAMPLE_RATES_HZ, read_configuration
from robot_drivers.ati.rdt.configuration import RdtConfiguration
from robot_drivers.ati.rdt.web import WebPages
from robot_drivers.fuzzing.mutations import mutated, overwritten
from robot_drivers.fuzzing.target import Target, WrongValueError, agree

_CONFIGURATION = b"""<?xml version="1.0" encoding="UTF-8"?>
<netft><runstat>0x00000000</runstat><runft>1;-2;3;4;5;-6</runft><setrate>976</setrate><setuserfilter>3</setuserfilter>
<cfgcalsel>1</cfgcalsel><cfgcalsn>FT1</cfgcalsn><cfgcpf>1000000</cfgcpf><cfgcpt>999.5</cfgcpt><scfgfu>lbf</scfgfu>
<scfgtu>Nm</scfgtu><comrdte>Enabled</comrdte><comrdtrate>500</comrdtrate><comrdtbsiz>40</comrdtbsiz></netft>
"""
_CALIBRATION = (
    b"<netftCalibration><calsn>FT1</calsn><calpn>SI-75-4</calpn><scalfu>N</scalfu><scaltu>N-mm</scaltu>"
    b"<calmr>75;75,235 4000;4000;4000</calmr></netftCalibration>"
)
_NEWTONS = {"n": 1.0, "lbf": 4.4482216152605, "kn": 1e3, "klbf": 4448.2216152605, "kgf": 9.80665}
_NEWTON_METRES = {"nm": 1.0, "n-m": 1.0, "n-mm": 1e-3, "nmm": 1e-3}


class _TwoPages(WebPages):
    """A sensor with these pages, whatever index is asked for."""

    def __init__(self, configuration: bytes, calibration: bytes) -> None:
        self._configuration = configuration
        self._calibration = calibration

    def page(self, path: str) -> bytes:
        """Return the page of that name."""
        return self._configuration if path.startswith("/netftapi2.xml") else self._calibration


def _pages(random: Random) -> tuple[bytes, bytes]:
    """Return both pages; one of them is damaged."""
    damage = mutated if random.random() < 0.3 else overwritten
    if random.random() < 0.5:
        return damage(random, [_CONFIGURATION]), _CALIBRATION
    return _CONFIGURATION, damage(random, [_CALIBRATION])


def _check(pages: tuple[bytes, bytes]) -> bool:
    """What is taken is what a document tree says, in SI by factors of this file's own."""
    found = read_configuration(_TwoPages(*pages))
    configuration, calibration = (_leaves(page) for page in pages)
    agree(found.scaling.counts_per_force, float(configuration["cfgcpf"]), "counts per force")
    agree(found.scaling.counts_per_torque, float(configuration["cfgcpt"]), "counts per torque")
    agree((found.serial, found.part_number), _texts(calibration, "calsn", "calpn"), "calibration")
    if found.sample_rate_hz not in (None, *SAMPLE_RATES_HZ):
        raise WrongValueError(f"a sample rate of {found.sample_rate_hz} Hz was taken for good")
    told = configuration.get("setrate")
    if found.sample_rate_hz is not None and told is not None:
        agree(found.sample_rate_hz, int(float(told)), "sample rate")
    _check_range(found, calibration)
    return True


def _check_range(found: RdtConfiguration, calibration: dict[str, str]) -> None:
    if found.rated_wrench is None:
        return
    told = [float(part) for part in re.findall(r"[^;,\s]+", calibration["calmr"])]
    newtons, newton_metres = (
        sizes.get(calibration[tag].lower())
        for sizes, tag in ((_NEWTONS, "scalfu"), (_NEWTON_METRES, "scaltu"))
    )
    for place, (rated, value) in enumerate(zip(found.rated_wrench, told, strict=True)):
        size = newtons if place < 3 else newton_metres
        if not (0 < rated < math.inf and (size is None or math.isclose(rated, value * size, rel_tol=1e-12))):
            raise WrongValueError(f"{calibration['calmr']!r} was read as {found.rated_wrench}")


def _leaves(page: bytes) -> dict[str, str]:
    document = expatbuilder.parseString(page, namespaces=False)  # the sensor knows none
    elements = [e for e in document.getElementsByTagName("*") if e is not document.documentElement]
    return {
        e.tagName: "".join(node.data for node in e.childNodes if node.nodeType == node.TEXT_NODE).strip()
        for e in elements
        if not e.getElementsByTagName("*")
    }


def _texts(tags: dict[str, str], *names: str) -> tuple[str, ...]:
    return tuple(tags.get(name, "") for name in names)


TARGETS = (
    Target("axia-pages", "a document tree has the same tags; the range in other factors", _pages, _check),
)
