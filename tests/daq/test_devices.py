"""The drivers that a rig file may name: this project's, and those of other packages."""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from daq import devices
from daq.cli import main
from daq.devices import CAMERA, FORCE_SENSOR, ROBOT, ROLES, Role, installed_drivers, with_plugins
from daq.errors import RigError
from daq.rig import CameraDevice, Device, Rig, make_devices, read_rig, write_rig
from daq.virtual_rig.layout import Addresses, rig_description
from estimator.errors import InputError
from estimator.plugins import Plugin
from robot_drivers.driver import Driver

ADDRESSES = Addresses(1, 2, 3, 4, 5, 6, ("tcp://127.0.0.1:7", "tcp://127.0.0.1:8"))


@dataclass(frozen=True, slots=True)
class BenchSettings:
    """The settings of a device that another package drives."""

    port: str
    rate_hz: int = 100

    def __post_init__(self) -> None:
        if not self.rate_hz > 0:
            raise ValueError(f"rate_hz must be positive, not {self.rate_hz}")


@dataclass
class BenchDevice:
    settings: BenchSettings


SETTINGS = BenchSettings("COM7", 250)
DRIVER = Driver(BenchSettings, BenchDevice)


def plugin(role: Role, value: object = DRIVER, name: str = "bench") -> Plugin:
    return Plugin(role.entry_points, name, "bench-devices 0.3", value)


def with_device(rig: Rig, role: Role) -> Rig:
    """The rig with the other package's device in a role; of the cameras the left one."""
    if role is CAMERA:
        return replace(rig, cameras=(CameraDevice("left", "bench", SETTINGS), rig.cameras[1]))
    device = Device("bench", SETTINGS)
    return replace(rig, robot=device) if role is ROBOT else replace(rig, force_sensor=device)


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Callable[[Plugin], None]:
    """Have a package installed."""

    def installed(one: Plugin) -> None:
        monkeypatch.setattr(devices, "plugins", lambda group: (one,) if group == one.group else ())

    return installed


@pytest.mark.parametrize("role", ROLES, ids=lambda role: role.words)
def test_a_rig_file_names_the_driver_of_another_package(
    role: Role, install: Callable[[Plugin], None], tmp_path: Path
) -> None:
    install(plugin(role))
    rig = with_device(rig_description(ADDRESSES, tmp_path / "stereo.toml"), role)
    write_rig(rig, tmp_path / "rig.toml")
    made = make_devices(read_rig(tmp_path / "rig.toml")).all()
    assert [device for device in made.values() if isinstance(device, BenchDevice)] == [BenchDevice(SETTINGS)]
    assert len(made) == 4


def test_what_its_settings_refuse_is_told_with_the_line_of_the_key(
    install: Callable[[Plugin], None], tmp_path: Path
) -> None:
    install(plugin(FORCE_SENSOR))
    path = tmp_path / "rig.toml"
    write_rig(with_device(rig_description(ADDRESSES, tmp_path / "stereo.toml"), FORCE_SENSOR), path)
    path.write_text(path.read_text().replace("rate_hz = 250", "rate_hz = 0"))
    line = path.read_text().splitlines().index("rate_hz = 0") + 1
    with pytest.raises(
        RigError, match=f"line {line}: force_sensor.settings.* rate_hz must be positive, not 0"
    ):
        read_rig(path)


@pytest.mark.parametrize(
    ("value", "name", "complaint"),
    [
        (BenchDevice, "bench", "names type, which is no robot_drivers.driver.Driver"),
        (Driver(str, BenchDevice), "bench", "the settings of a driver are a dataclass, not <class 'str'>"),
        (DRIVER, "netft", "a driver of a force sensor is called 'netft' already"),
    ],
)
def test_what_is_no_driver_or_takes_a_name_is_refused_with_the_package_s_name(
    value: object, name: str, complaint: str
) -> None:
    with pytest.raises(InputError) as caught:
        with_plugins(FORCE_SENSOR, [plugin(FORCE_SENSOR, value, name)])
    assert str(caught.value).startswith(
        f"package bench-devices 0.3, entry point '{name}' of retract.force_sensors: {complaint}"
    )


def test_a_broken_package_stops_no_rig_that_does_not_need_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def broken(group: str) -> tuple[Plugin, ...]:
        raise InputError(f"package old 1.0, entry point 'x' of {group}: cannot be imported")

    monkeypatch.setattr(devices, "plugins", broken)
    rig = rig_description(ADDRESSES, tmp_path / "stereo.toml")
    write_rig(rig, tmp_path / "rig.toml")
    assert read_rig(tmp_path / "rig.toml").robot.driver == "irb140"
    write_rig(with_device(rig, ROBOT), tmp_path / "rig.toml")
    with pytest.raises(RigError, match=r"package old 1\.0"):
        read_rig(tmp_path / "rig.toml")


def test_the_list_tells_every_driver_its_settings_and_its_package(
    install: Callable[[Plugin], None], capsys: pytest.CaptureFixture[str]
) -> None:
    install(plugin(CAMERA))
    assert main(["devices", "--list"]) == 0
    text = capsys.readouterr().out
    assert re.search(r"^  bench +port, rate_hz  \[bench-devices 0\.3\]$", text, re.MULTILINE)
    for role in ROLES:
        assert all(f"  {driver.name} " in text for driver in installed_drivers(role))
    assert main(["devices", "--list", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["drivers"]
    assert told["camera"]["bench"] == {"package": "bench-devices 0.3", "settings": ["port", "rate_hz"]}
    assert told["robot"]["open_abb"]["package"] is None


def test_devices_without_a_rig_says_what_to_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["devices"]) == 2
    assert "name a rig file, or virtual; --list tells the drivers" in capsys.readouterr().err
