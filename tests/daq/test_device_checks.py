"""What the checks of devices pass and what they do not, on devices made of arithmetic."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_devices import FakeCamera, FakeForceSensor, FakeRobot

from daq.device_checks import DeviceReport, check_devices
from daq.devices import Devices
from daq.rig import Rig
from daq.virtual_rig.layout import REST_TOOL, Addresses, rig_description
from daq.virtual_rig.rendering.scene import flea2_pair
from robot_drivers.ati.transducer.gamma import GAGE_NOISE_STD
from robot_drivers.errors import DeviceUnreachableError
from robot_drivers.protocols import DeviceIdentity, RobotState, StreamStatistics, WrenchBlock

ADDRESSES = Addresses(1, 2, 3, 4, 5, 6, ("tcp://127.0.0.1:7", "tcp://127.0.0.1:8"))
SECONDS = 0.15
JOINTS = (0.0, 0.3, 0.5, 0.0, 0.8, 0.0)


class NoisySensor(FakeForceSensor):
    """Reads ``wrench`` with white noise of ``noise`` times that of one count on every gage."""

    noise = 1.0
    lost = 0

    def __init__(self) -> None:
        super().__init__()
        self.random = np.random.default_rng(0)

    @property
    def identity(self) -> DeviceIdentity:
        return DeviceIdentity("force sensor", "fake Gamma", "FT1", "memory", {"units": "N, N-m"})

    def statistics(self) -> StreamStatistics:
        return StreamStatistics(received=self.counter, lost=self.lost)

    def read(self, timeout_s: float) -> WrenchBlock:
        block = super().read(timeout_s)
        noise = self.noise * self.random.standard_normal((len(block), 6)) * GAGE_NOISE_STD
        return replace(block, wrench=block.wrench + noise)


class PlacedRobot(FakeRobot):
    joints = JOINTS
    ready = True

    def state(self) -> RobotState:
        message = "" if self.ready else "motors off"
        return replace(super().state(), joints=self.joints, ready=self.ready, message=message)


class SizedCamera(FakeCamera):
    def __init__(self, width: int = 1288, height: int = 964) -> None:
        super().__init__()
        self.image = np.full((height, width), 120, np.uint8)


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    flea2_pair().save(tmp_path / "stereo.toml")
    return rig_description(ADDRESSES, tmp_path / "stereo.toml")


@pytest.fixture
def devices() -> Devices:
    return Devices(NoisySensor(), PlacedRobot(REST_TOOL), {"left": SizedCamera(), "right": SizedCamera()})


def checked(rig: Rig, devices: Devices) -> dict[str, DeviceReport]:
    return {report.role: report for report in check_devices(rig, devices, SECONDS)}


def failed(report: DeviceReport) -> list[str]:
    return [check.name for check in report.checks if not check.passed]


def test_healthy_devices_pass_every_check(rig: Rig, devices: Devices) -> None:
    reports = checked(rig, devices)
    assert {role: failed(report) for role, report in reports.items()} == {
        "force sensor": [],
        "robot": [],
        "camera left": [],
        "camera right": [],
    }
    assert [check.name for check in reports["force sensor"].checks] == [
        *("reachable", "identity", "rate", "losses", "units", "saturation", "range", "noise")
    ]
    assert [check.name for check in reports["robot"].checks] == [
        *("reachable", "identity", "state", "rate", "losses", "joints", "workspace")
    ]
    assert [check.name for check in reports["camera left"].checks] == [
        *("reachable", "identity", "rate", "losses", "format", "exposure")
    ]


def test_devices_are_closed_after_their_check(rig: Rig, devices: Devices) -> None:
    checked(rig, devices)
    assert all(device.closed for device in devices.all().values())


def noisy(sensor: NoisySensor) -> None:
    sensor.noise = 30.0


def frozen(sensor: NoisySensor) -> None:
    sensor.noise = 0.0


def overloaded(sensor: NoisySensor) -> None:
    sensor.wrench[2] = 248.0


def faulty(sensor: NoisySensor) -> None:
    sensor.usable = False


def lossy(sensor: NoisySensor) -> None:
    sensor.lost = 3


@pytest.mark.parametrize(
    ("spoil", "check", "told"),
    [
        (noisy, "noise", "at most"),
        (frozen, "noise", "repeats one sample"),
        (overloaded, "range", "Fz at 62 % of its ±400 N"),
        (faulty, "saturation", "100 % of the samples not usable"),
        (lossy, "losses", "3 lost"),
    ],
)
def test_what_is_wrong_with_a_sensor_fails_its_check_alone(
    rig: Rig, devices: Devices, spoil: Callable[[NoisySensor], None], check: str, told: str
) -> None:
    spoil(devices.force_sensor)
    report = checked(rig, devices)["force sensor"]
    assert failed(report) == [check]
    assert told in next(c.told for c in report.checks if c.name == check)


def test_a_rate_other_than_the_rig_file_says_fails(rig: Rig, devices: Devices) -> None:
    settings = replace(rig.force_sensor.settings, rate_hz=7000)
    report = checked(replace(rig, force_sensor=replace(rig.force_sensor, settings=settings)), devices)[
        "force sensor"
    ]
    assert failed(report) == ["rate"]
    assert "the settings say 7000" in next(c.told for c in report.checks if c.name == "rate")


def test_a_joint_close_to_its_end_fails(rig: Rig, devices: Devices) -> None:
    devices.robot.joints = (*JOINTS[:4], 2.0, 0.0)
    assert failed(checked(rig, devices)["robot"]) == ["joints"]


def test_a_robot_that_would_refuse_to_move_fails_with_its_reason(rig: Rig, devices: Devices) -> None:
    devices.robot.ready = False
    report = checked(rig, devices)["robot"]
    assert failed(report) == ["state"]
    assert "motors off" in next(c.told for c in report.checks if c.name == "state")


def test_a_gripper_outside_the_workspace_fails(rig: Rig, devices: Devices) -> None:
    x, y, z = REST_TOOL.position
    devices.robot.pose = replace(REST_TOOL, position=(x, y, z + 1.0))
    assert failed(checked(rig, devices)["robot"]) == ["workspace"]


def test_images_that_the_calibration_is_not_for_fail(rig: Rig, devices: Devices) -> None:
    devices.cameras["left"].image = np.full((480, 640), 120, np.uint8)
    assert failed(checked(rig, devices)["camera left"]) == ["format"]


def test_a_white_image_fails(rig: Rig, devices: Devices) -> None:
    devices.cameras["right"].image[:] = 255
    assert failed(checked(rig, devices)["camera right"]) == ["exposure"]


def test_a_device_that_is_not_there_hides_no_other(
    rig: Rig, devices: Devices, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unreachable() -> None:
        raise DeviceUnreachableError("nobody answers")

    monkeypatch.setattr(devices.force_sensor, "connect", unreachable)
    reports = checked(rig, devices)
    assert failed(reports["force sensor"]) == ["reachable"]
    assert reports["force sensor"].identity is None
    assert failed(reports["robot"]) == []
