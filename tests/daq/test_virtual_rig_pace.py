"""The laboratory's time waits for whatever is behind, for the phantom above all, and nothing real lives on it."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from daq.devices import connected
from daq.errors import RigError
from daq.progress import silent
from daq.recording.folder import read_info
from daq.rig import CameraDevice, Device, Rig, make_devices, read_rig, write_rig
from daq.session.session import Label, run_session
from daq.session_report import read_report
from daq.timing.laboratory_time import in_the_time_of
from daq.trajectories import PULL, Dwell
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.layout import GRASP_CENTRE, Addresses, placed_beads, rig_description
from daq.virtual_rig.pace import Pace, lateness
from daq.virtual_rig.physics.phantom import PhantomState, SpringPhantom
from daq.virtual_rig.processes import VirtualRigSettings
from robot_drivers.abb.irb140 import IRB140Settings
from robot_drivers.ati.digital_ft import DigitalFTSettings
from robot_drivers.ati.netft import NetFTSettings
from robot_drivers.cameras.dc1394_settings import DC1394CameraSettings
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.clock import host_time_ns, monotonic_time_ns
from robot_drivers.laboratory_clock import ClockKeeper
from robot_drivers.protocols import Pose

SPRINGS = SpringPhantom(GRASP_CENTRE, placed_beads(1))
SHORT = replace(PULL, steps=2, return_steps=0, dwell=Dwell(rest_s=0.4, settle_s=0.5, measure_s=0.4))
PATIENCE_S = 60.0


class SlowSprings(SpringPhantom):
    """A phantom whose every solution takes four times as long as may be waited for without harm."""

    def build(self) -> "SlowSprings":
        return self

    def solve(self, T_tissue_gripper: Pose) -> PhantomState:
        time.sleep(1.0)
        return super().solve(T_tissue_gripper)


class BreakingSprings(SpringPhantom):
    """A phantom whose solver dies once the gripper moves."""

    def build(self) -> "BreakingSprings":
        return self

    def solve(self, T_tissue_gripper: Pose) -> PhantomState:
        if T_tissue_gripper.position[0] > GRASP_CENTRE[0] + 1.5e-3:
            raise SystemExit
        return super().solve(T_tissue_gripper)


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.002)


@pytest.fixture
def keeper(tmp_path: Path) -> ClockKeeper:
    return ClockKeeper(tmp_path / "clock")


def test_time_stands_until_there_is_something_to_follow_and_while_one_is_behind(keeper: ClockKeeper) -> None:
    behind_s = [0.0, 0.0]
    with Pace(keeper) as pace:
        begun_ns = keeper.time_ns()
        time.sleep(0.1)
        assert keeper.time_ns() == begun_ns
        pace.follow([lateness(lambda: behind_s[0], 0.1), lateness(lambda: behind_s[1], 0.2)])
        wait_for(lambda: keeper.time_ns() > begun_ns + 50_000_000)
        behind_s[1] = 0.3
        time.sleep(0.1)
        stands_ns = keeper.time_ns()
        time.sleep(0.1)
        assert keeper.time_ns() == stands_ns
        behind_s[1] = 0.19
        wait_for(lambda: keeper.time_ns() > stands_ns)


class CountingKeeper(ClockKeeper):
    """Notes how much time was granted at a time, ns."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.granted_ns: list[int] = []

    def grant(self, ahead_ns: int) -> None:
        self.granted_ns.append(ahead_ns)
        super().grant(ahead_ns)


@pytest.mark.parametrize(("rooms_s", "granted_ns"), [((1.0, 0.012), 12_000_000), ((0.5, 1.0), 30_000_000)])
def test_no_more_time_is_granted_at_once_than_all_have_room_for(
    tmp_path: Path, rooms_s: tuple[float, ...], granted_ns: int
) -> None:
    keeper = CountingKeeper(tmp_path / "clock")
    with Pace(keeper) as pace:
        pace.follow([partial(float, room_s) for room_s in rooms_s])
        wait_for(lambda: len(keeper.granted_ns) > 3)
    assert set(keeper.granted_ns) == {granted_ns}


def test_a_slow_phantom_slows_the_laboratory_and_nothing_is_lost_late_or_wrong(tmp_path: Path) -> None:
    slow = SlowSprings(GRASP_CENTRE, placed_beads(1))
    with virtual_rig(tmp_path, VirtualRigSettings(slow, seed=1, frames_per_s=4.0)) as running:
        rig = read_rig(running.rig_path)
        with connected(make_devices(rig)) as devices:
            run_session(rig, devices, SHORT.trajectory(), tmp_path / "session", Label("pull"), silent)
        assert running.notices() == []
    info, report = read_info(tmp_path / "session"), read_report(tmp_path / "session")
    assert info.problems == ()
    assert report.slowdown > 1.3
    assert report.pace_lines() == [
        f"the emulated laboratory ran {report.slowdown:.1f} times slower than real time"
    ]
    assert [stream.missing for stream in report.streams.values()] == [0, 0, 0, 0]
    force = report.streams["force"]
    known_to_s = 1e-3  # either end of a recording, on a computer that is busy otherwise
    tolerance_ppm = 1e6 * 2 * known_to_s / (force.samples * force.period_s)
    assert force.drift_ppm == pytest.approx(30.0, abs=tolerance_ppm)
    assert read_rig(tmp_path / "session" / "rig.toml").laboratory_clock is None


def test_a_phantom_that_cannot_be_solved_any_more_ends_its_laboratory_and_says_so(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    breaking = BreakingSprings(GRASP_CENTRE, placed_beads(1))
    with virtual_rig(tmp_path, VirtualRigSettings(breaking, frames_per_s=4.0)) as running:
        rig = read_rig(running.rig_path)
        with (
            connected(make_devices(rig)) as devices,
            pytest.raises(Exception, match=r"lost|closed|ended|held"),
        ):
            run_session(rig, devices, SHORT.trajectory(), tmp_path / "session", Label("pull"), silent)
    assert "the virtual phantom cannot be solved any more" in capfd.readouterr().err
    assert read_info(tmp_path / "session").state == "sealed"


@pytest.fixture
def emulated(keeper: ClockKeeper, tmp_path: Path) -> Rig:
    """A rig of emulated devices with a clock of its own."""
    keeper.grant(3_600_000_000_000)
    cameras = ("tcp://127.0.0.1:5", "tcp://127.0.0.1:6")
    rig = rig_description(Addresses(1, 2, 3, 4, 5, 6, cameras), tmp_path / "stereo.toml")
    return replace(rig, laboratory_clock=tmp_path / "clock")


def test_who_uses_a_rig_of_emulated_devices_lives_on_its_clock_meanwhile(
    emulated: Rig, tmp_path: Path
) -> None:
    write_rig(emulated, tmp_path / "rig.toml")
    before_ns = host_time_ns() - monotonic_time_ns()
    time.sleep(0.01)
    with in_the_time_of(read_rig(tmp_path / "rig.toml")):
        assert host_time_ns() < monotonic_time_ns()
    assert abs(host_time_ns() - monotonic_time_ns() - before_ns) < 1_000_000


def real_sensor(rig: Rig) -> Rig:
    return replace(rig, force_sensor=Device("netft", NetFTSettings(host="192.168.1.1")))


def serial_sensor(rig: Rig) -> Rig:
    return replace(rig, force_sensor=Device("digital_ft", DigitalFTSettings(port="/dev/ttyUSB0")))


def real_robot(rig: Rig) -> Rig:
    return replace(rig, robot=Device("irb140", IRB140Settings("robot.local")))


def real_camera(rig: Rig) -> Rig:
    return replace(rig, cameras=(rig.cameras[0], CameraDevice("right", "dc1394", DC1394CameraSettings())))


def camera_by_index(rig: Rig) -> Rig:
    return replace(rig, cameras=(CameraDevice("left", "opencv", OpenCVCameraSettings("0")), rig.cameras[1]))


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (real_sensor, "force sensor"),
        (serial_sensor, "force sensor"),
        (real_robot, "robot"),
        (real_camera, "camera right"),
        (camera_by_index, "camera left"),
    ],
)
def test_nothing_real_ever_lives_on_a_laboratorys_clock(
    emulated: Rig, change: Callable[[Rig], Rig], named: str
) -> None:
    with (
        pytest.raises(RigError, match=f"{named} is not one; remove laboratory_clock"),
        in_the_time_of(change(emulated)),
    ):
        pass


def test_a_rig_file_of_a_laboratory_that_has_ended_says_so(emulated: Rig) -> None:
    gone = replace(emulated, laboratory_clock=Path("gone/clock"))
    with pytest.raises(RigError, match="that laboratory has ended, start it anew"), in_the_time_of(gone):
        pass
