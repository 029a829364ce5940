"""What every force sensor makes of its settings: those that cannot be right are refused, the others say what it is."""

from dataclasses import dataclass

import pytest

from robot_drivers import bota
from robot_drivers.ati import axia, controller_ft, digital_ft, netbox_can, netcanoem, netft
from robot_drivers.ati.transducer.gamma import RATED_WRENCH as GAMMA
from robot_drivers.driver import Driver
from robot_drivers.errors import ConfigurationError

M20 = (500.0, 500.0, 900.0, 20.0, 20.0, 20.0)
NO_RANGE = (1.0, 1.0, 1.0, 1.0, 0.0, 1.0)
SCALE = {"counts_per_newton": 10.0, "counts_per_newton_metre": 500 / 3}
BOX_ON_CAN = {
    "channel": "can0",
    "bitrate": 1_000_000,
    "base": 0x1B0,
    "counts_per_force": 1e6,
    "counts_per_torque": 1e6,
    "rate_hz": 200.0,
}


@dataclass(frozen=True)
class Kind:
    """A driver and settings that are just enough for it."""

    driver: Driver
    enough: dict[str, object]

    def settings(self, **changes: object) -> object:
        return self.driver.settings(**self.enough | changes)


KINDS = {
    "Net F/T": Kind(netft.DRIVER, {"host": "ft"}),
    "Ethernet Axia": Kind(axia.DRIVER, {"host": "axia"}),
    "Digital F/T": Kind(digital_ft.DRIVER, {"port": "none"}),
    "F/T Controller": Kind(controller_ft.DRIVER, {"port": "none", **SCALE}),
    "Bota": Kind(bota.DRIVER, {"port": "none"}),
    "NETCANOEM": Kind(netcanoem.DRIVER, {"channel": "can0"}),
    "Net Box on CAN": Kind(netbox_can.DRIVER, BOX_ON_CAN),
}
WRONG = {
    "Net F/T": [
        ({"mode": "fast"}, "mode 'fast'"),
        ({"rate_hz": 0}, "rate_hz 0"),
        ({"rate_hz": 7001}, "rate_hz 7001"),
        ({"rate_hz": 1000, "scaling_source": "command-interface"}, "rate_hz"),
        ({"scaling_source": "guess"}, "scaling_source 'guess'"),
        ({"status_map": "gamma"}, "status_map 'gamma'"),
        ({"silence_s": 0.0}, "silence_s 0.0"),
        ({"internal_rate_hz": float("nan")}, "internal_rate_hz nan"),
        ({"rated_wrench": NO_RANGE}, "rated_wrench"),
    ],
    "Ethernet Axia": [
        ({"mode": "fast"}, "mode 'fast'"),
        ({"rate_hz": 0}, "rate_hz 0"),
        ({"rate_hz": 7913}, "rate_hz 7913"),
        ({"sample_rate_hz": 0.0}, "sample_rate_hz"),
        ({"silence_s": float("inf")}, "silence_s"),
        ({"rated_wrench": NO_RANGE}, "rated_wrench"),
    ],
    "Digital F/T": [
        ({"bit_rate": 115200}, "at most 806 samples"),
        ({"sample_rate_hz": 0.0}, "sample_rate_hz"),
        ({"slave_address": 0}, "1..247"),
        ({"calibration_index": 17}, "1..16"),
        ({"silence_s": 0.0}, "silence_s"),
        ({"batch_s": float("nan")}, "batch_s"),
    ],
    "F/T Controller": [
        ({"record_format": "hex"}, "'ascii' or 'binary'"),
        ({"record_bits": 32}, "16 or 24"),
        ({"record_rate_hz": 0.0}, "record_rate_hz"),
        ({"averaging": -1}, "averaging"),
        ({"counts_per_newton": 0.0}, "counts_per_newton"),
        ({"bit_rate": 0}, "bit_rate"),
    ],
    "Bota": [
        ({"bit_rate": 19200}, "bit_rate"),
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"rate_hz": 1300.0}, "rate_hz"),
        ({"start_timeout_s": float("nan")}, "start_timeout_s"),
        ({"rated_wrench": NO_RANGE}, "rated_wrench"),
    ],
    "NETCANOEM": [
        ({"base": 0x200}, "before it is shifted"),
        ({"calibration": 16}, "calibration 16"),
        ({"rate_hz": 0.0}, "rate_hz 0"),
        ({"rate_hz": 1000.0}, "at most 800"),
        ({"answer_timeout_s": 0.0}, "answer_timeout_s"),
    ],
    "Net Box on CAN": [
        ({"base": 0x7FF}, "0x7ff"),
        ({"answer": "short"}, "READCALINFO"),
        ({"long_order": ("fx",) * 8}, "each of fx"),
        ({"long_request_code": 256}, "one byte"),
        ({"sample_rate_hz": -1.0}, "sample_rate_hz"),
        ({"force_unit": "stone"}, "unknown force unit"),
        ({"counts_per_force": 0.0}, "counts per force"),
        ({"bitrate": 125_000, "rate_hz": 300.0}, "at most 251"),
        ({"answer_timeout_s": 0.0}, "answer_timeout_s"),
    ],
}


@pytest.mark.parametrize(
    ("kind", "changes", "words"),
    [(kind, *case) for kind, cases in WRONG.items() for case in cases],
)
def test_settings_that_cannot_be_right_are_refused(kind: str, changes: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        KINDS[kind].settings(**changes)


@pytest.mark.parametrize("kind", KINDS)
def test_settings_that_are_just_enough_are_taken(kind: str) -> None:
    assert KINDS[kind].settings()


@pytest.mark.parametrize(
    ("kind", "changes", "rated_wrench", "rate_hz"),
    [
        ("Net F/T", {}, GAMMA, None),
        ("Net F/T", {"rated_wrench": M20, "rate_hz": 500}, M20, 500),
        ("Ethernet Axia", {}, None, None),
        ("Ethernet Axia", {"rated_wrench": M20, "rate_hz": 500}, M20, 500),
        ("Digital F/T", {"sample_rate_hz": 1000.0}, GAMMA, 1000.0),
        ("F/T Controller", {"rated_wrench": M20, "record_rate_hz": 50.0}, M20, 50.0),
        ("Bota", {"rate_hz": 800.0}, None, 800.0),
        ("NETCANOEM", {"rated_wrench": M20, "rate_hz": 100.0}, M20, 100.0),
        ("Net Box on CAN", {"rated_wrench": M20}, M20, 200.0),
    ],
)
def test_the_specification_is_what_the_rig_file_says(
    kind: str, changes: dict[str, object], rated_wrench: object, rate_hz: float | None
) -> None:
    specification = KINDS[kind].driver.specify(KINDS[kind].settings(**changes))
    assert (specification.rated_wrench, specification.rate_hz) == (rated_wrench, rate_hz)
    noise_is_known = kind not in ("Ethernet Axia", "Bota")
    assert (specification.noise_std is not None) == noise_is_known
