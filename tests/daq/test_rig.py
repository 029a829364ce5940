from dataclasses import replace
from pathlib import Path

import pytest

from daq.errors import RigError
from daq.rig import CameraDevice, Device, Rig, make_devices, read_rig, write_rig
from daq.virtual_rig.layout import Addresses, rig_description
from robot_drivers.abb.egm.guidance import EGMGuidedRobot
from robot_drivers.abb.egm.guidance_session import EGMGuidanceSettings
from robot_drivers.abb.irb140 import IRB140
from robot_drivers.abb.open_abb import OpenABB, OpenABBSettings
from robot_drivers.ati.digital_ft import DigitalFT, DigitalFTSettings
from robot_drivers.ati.netbox_can import NetBoxCan, NetBoxCanSettings
from robot_drivers.ati.netcanoem import NetCANOEM, NetCANOEMSettings
from robot_drivers.ati.netft import NetFT
from robot_drivers.cameras.dc1394 import DC1394Camera, DC1394CameraSettings
from robot_drivers.cameras.opencv import OpenCVCamera
from robot_drivers.protocols import Pose

ADDRESSES = Addresses(1, 2, 3, 4, 5, 6, ("tcp://127.0.0.1:7", "tcp://127.0.0.1:8"))
NETBOX_CAN = NetBoxCanSettings(
    channel="can0", bitrate=500_000, base=0x1B0, counts_per_force=1e6, counts_per_torque=1e6
)


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    return rig_description(ADDRESSES, tmp_path / "stereo.toml")


@pytest.fixture
def rig_path(rig: Rig, tmp_path: Path) -> Path:
    write_rig(rig, tmp_path / "rig.toml")
    return tmp_path / "rig.toml"


def edit(path: Path, old: str, new: str) -> int:
    """Replace one text in the file and return the number of its line."""
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    return text[: text.index(old)].count("\n") + 1


def test_a_rig_is_read_back_as_it_was_written(rig: Rig, rig_path: Path) -> None:
    assert read_rig(rig_path) == rig


def test_the_calibration_is_named_relative_to_the_rig_file(rig_path: Path, tmp_path: Path) -> None:
    assert 'stereo_calibration = "stereo.toml"' in rig_path.read_text()
    assert read_rig(rig_path).stereo_calibration == tmp_path / "stereo.toml"


def test_a_rig_makes_its_devices_without_touching_the_network(rig: Rig) -> None:
    devices = make_devices(rig)
    assert isinstance(devices.force_sensor, NetFT)
    assert isinstance(devices.robot, IRB140)
    assert list(devices.cameras) == ["left", "right"]
    assert isinstance(devices.cameras["left"], OpenCVCamera)


@pytest.mark.parametrize(
    ("place", "driver", "settings", "made"),
    [
        ("force_sensor", "netbox_can", NETBOX_CAN, NetBoxCan),
        ("force_sensor", "netcanoem", NetCANOEMSettings(channel="can0"), NetCANOEM),
        ("force_sensor", "digital_ft", DigitalFTSettings(port="/dev/ttyUSB0"), DigitalFT),
        ("robot", "open_abb", OpenABBSettings("robot", T_flange_tool=Pose((0.0, 0.0, 0.14))), OpenABB),
        ("robot", "egm_guidance", EGMGuidanceSettings(), EGMGuidedRobot),
    ],
)
def test_every_driver_can_be_named_with_its_settings(
    rig: Rig, tmp_path: Path, place: str, driver: str, settings: object, made: type
) -> None:
    named = replace(rig, **{place: Device(driver, settings)})
    write_rig(named, tmp_path / "rig.toml")
    assert read_rig(tmp_path / "rig.toml") == named
    assert isinstance(getattr(make_devices(named), place), made)


def test_firewire_cameras_can_be_named_by_their_numbers(rig: Rig, tmp_path: Path) -> None:
    left, right = (
        CameraDevice(name, "dc1394", DC1394CameraSettings(guid=guid, pixel_format="bayer_rggb8", fps=25.0))
        for name, guid in (("left", "00b09d0100a1b2c3"), ("right", "00b09d0100a1b2c4"))
    )
    named = replace(rig, cameras=(left, right))
    write_rig(named, tmp_path / "rig.toml")
    assert read_rig(tmp_path / "rig.toml") == named
    assert isinstance(make_devices(named).cameras["left"], DC1394Camera)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("force_n = 15.0", 'force_n = "15"', r"limits\.force_n must be of type float, not '15'"),
        ("force_n = 15.0", "force_n = -15.0", "limits is refused: force_n must be positive"),
        ("force_n = 15.0", "force_n = nan", r"limits\.force_n must be finite"),
        ("force_n = 15.0", "forse_n = 15.0", r"limits\.forse_n is no known key; allowed here: force_n, torque_nm"),
        ("force_n = 15.0\n", "", "limits lacks the key force_n"),
        ('driver = "netft"', 'driver = "netfit"', r"force_sensor\.driver must be one of 'netft', .*not 'netfit'"),
        ("rdt_port = 1\n", "rdt_port = 1.5\n", r"force_sensor\.settings\.rdt_port must be of type int, not 1\.5"),
        ('mode = "real-time"', 'mode = "fast"', r"settings\.mode must be one of 'real-time', 'buffered'"),
        ('8"\nbackend = "ffmpeg"', '8"\nbackend = 1', r"cameras\.1\.settings\.backend must be one of"),
        ("position_m = [0.45, 0.0, 0.2]", "position_m = [0.45, 0.2]", r"position_m must have 3 entries, not 2"),
        ("quaternion_wxyz = [0.0, 1.0, 0.0, 0.0]", "quaternion_wxyz = [0.0, 1.0, 1.0, 0.0]", "needs 1"),
        ('shape = "block"', 'shape = "ball"', r"specimen\.phantom\.shape must be one of 'block', 'surface'"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_with_its_line(rig_path: Path, old: str, new: str, complaint: str) -> None:
    line = edit(rig_path, old, new)
    with pytest.raises(RigError, match=complaint) as caught:
        read_rig(rig_path)
    told = int(str(caught.value).split("line ")[1].split(":")[0])
    assert abs(told - line) <= 2  # a complaint about a table names its header


def test_the_line_of_a_key_in_the_second_camera_is_its_own(rig_path: Path) -> None:
    lines = rig_path.read_text().splitlines()
    number = len(lines) - lines[::-1].index("buffer_frames = 16")
    lines[number - 1] = "buffer_frames = 0.5"
    rig_path.write_text("\n".join(lines))
    with pytest.raises(RigError, match=f"line {number}: cameras.1.settings.buffer_frames"):
        read_rig(rig_path)


def test_a_refusal_of_the_driver_is_told_like_any_other(rig_path: Path) -> None:
    edit(rig_path, 'mode = "real-time"', 'mode = "real-time"\nrate_hz = 9000')
    with pytest.raises(RigError, match=r"force_sensor\.settings is refused: .*must be 1\.\.7000"):
        read_rig(rig_path)


def test_another_format_is_refused(rig_path: Path) -> None:
    edit(rig_path, "retraction-rig/1", "retraction-rig/2")
    with pytest.raises(RigError, match=r'line 1: format must be "retraction-rig/1"'):
        read_rig(rig_path)


def test_two_cameras_of_one_name_are_refused(rig: Rig, tmp_path: Path) -> None:
    left, right = rig.cameras
    write_rig(replace(rig, cameras=(left, replace(right, name="left"))), tmp_path / "rig.toml")
    with pytest.raises(RigError, match="must differ"):
        read_rig(tmp_path / "rig.toml")


def test_a_missing_file_and_broken_toml_are_told(tmp_path: Path) -> None:
    with pytest.raises(RigError, match="there is no such file"):
        read_rig(tmp_path / "none.toml")
    (tmp_path / "rig.toml").write_text("[limits\n")
    with pytest.raises(RigError, match="line 1"):
        read_rig(tmp_path / "rig.toml")
