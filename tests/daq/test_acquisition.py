import math
import operator
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from listening import ears
from session_endings import stop_of, wait_until_sealed

from daq.acquisition.client import Acquisition
from daq.devices import connected
from daq.errors import MotionLimitError, SessionError, SoftwareStopError
from daq.progress import silent
from daq.recording.folder import read_info, verify_checksums
from daq.recording.reader import Recording, open_recording
from daq.rig import Rig, make_devices, read_rig
from daq.session.session import Label
from daq.session_report import read_report
from daq.trajectories import PULL, Dwell
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.layout import GRASP_CENTRE, REST_TOOL, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.processes import VirtualRigSettings
from robot_drivers.clock import host_time_s
from robot_drivers.errors import DeviceUnreachableError, MotionRefusedError
from robot_drivers.protocols import Speed

SHORT = replace(
    PULL, steps=1, step_length=0.002, return_steps=1, dwell=Dwell(rest_s=0.3, settle_s=0.1, measure_s=0.3)
)
CLIENT = Path(__file__).with_name("acquisition_client.py")


@pytest.fixture(scope="module")
def rig_path(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    settings = VirtualRigSettings(SpringPhantom(GRASP_CENTRE, placed_beads(1)), seed=1, frames_per_s=4.0)
    with virtual_rig(tmp_path_factory.mktemp("laboratory"), settings) as running:
        yield running.rig_path


@pytest.fixture
def rig(rig_path: Path) -> Rig:
    """The rig; its robot released and at rest."""
    rig = read_rig(rig_path)
    with connected(make_devices(rig)) as devices:
        devices.robot.resume()
        devices.robot.move_linear(REST_TOOL, Speed(0.02, 0.25), 5.0)
    return rig


def test_a_session_in_the_acquisition_process_is_recorded_and_sealed(rig: Rig, tmp_path: Path) -> None:
    told: list[tuple[str, int, int]] = []
    with Acquisition(rig) as acquisition:
        assert acquisition.devices["force sensor"].serial == "FT33206"
        info = acquisition.record(
            SHORT.trajectory(), tmp_path / "s", Label("pull"), lambda *step: told.append(step)
        )
    assert info == read_info(tmp_path / "s")
    assert info.state == "sealed"
    assert not any("not written" in problem for problem in info.problems)
    assert ("step 1: pulling to (2.0, 0.0, 0.0) mm", 1, 3) in told
    assert len(Recording(tmp_path / "s").force) == info.samples["/force/wrench"] > 500


def test_telemetry_shows_the_devices_before_anything_is_recorded(rig: Rig) -> None:
    with Acquisition(rig) as acquisition:
        deadline = time.monotonic() + 60.0
        forces, poses, images = 0, 0, {}
        while time.monotonic() < deadline and not (forces > 100 and poses > 100 and len(images) == 2):
            acquisition.poll(0.05)
            if (seen := acquisition.telemetry) is not None:
                forces, poses = forces + len(seen.force), poses + len(seen.pose)
                images |= seen.images
    assert seen is not None
    assert (seen.state, seen.session, seen.held) == ("ready", None, "")
    assert seen.counts["force"].received > 100
    assert seen.counts["force"].lost == seen.counts["force"].dropped == 0
    assert seen.counts["robot"].age_s < 1.0
    assert seen.force.shape[1:] == (7,)
    assert images["left"].shape == (241, 322)
    np.testing.assert_allclose(seen.pose[-1, 1:4], REST_TOOL.position, atol=1e-4)


def test_a_robot_held_before_it_was_connected_is_told_and_can_be_released(rig: Rig) -> None:
    with connected(make_devices(rig)) as devices:
        devices.robot.hold()
    with Acquisition(rig) as acquisition:
        assert "held before" in held(acquisition, bool)
        acquisition.release()
        assert held(acquisition, operator.not_) == ""


def held(acquisition: Acquisition, wanted: Callable[[str], bool]) -> str:
    """Return why the robot is held, as soon as that is as wanted, or in the end."""
    deadline = time.monotonic() + 60.0
    reason = ""
    while time.monotonic() < deadline:
        acquisition.poll(0.05)
        if acquisition.telemetry is not None:
            reason = acquisition.telemetry.held
            if wanted(reason):
                break
    return reason


def test_what_the_session_refuses_is_told_to_the_client(rig: Rig, tmp_path: Path) -> None:
    with Acquisition(rig) as acquisition:
        too_far = replace(SHORT, steps=3, step_length=0.02)
        with pytest.raises(MotionLimitError, match=r"step 1: 20\.00 mm exceed the limit"):
            acquisition.record(too_far.trajectory(), tmp_path / "s", Label("far"), silent)
        turned_too_far = replace(SHORT, angle=math.radians(60.0))
        with pytest.raises(
            MotionRefusedError, match=r"step 1 of 2 refused, nothing has moved: it turns by 60\.00°"
        ):
            acquisition.record(turned_too_far.trajectory(), tmp_path / "s", Label("turned"), silent)
        with pytest.raises(SessionError, match="nothing is being recorded"):
            acquisition.note("too early")
            acquisition.poll(5.0)
    assert not (tmp_path / "s").exists()


def test_devices_that_do_not_answer_are_told_in_one_line(rig: Rig) -> None:
    absent = replace(rig.robot, settings=replace(rig.robot.settings, command_port=1))  # type: ignore[type-var]
    with pytest.raises(DeviceUnreachableError, match=r"127\.0\.0\.1"):
        Acquisition(replace(rig, robot=absent))


def test_a_note_is_recorded_and_a_hold_ends_the_session_until_it_is_released(
    rig: Rig, tmp_path: Path
) -> None:
    with Acquisition(rig) as acquisition:
        acquisition.start(SHORT.trajectory(), tmp_path / "s", Label("held"))
        while acquisition.telemetry is None or acquisition.telemetry.step < 1:
            assert acquisition.poll(0.05) is None
        acquisition.note("the lamp flickered")
        acquisition.hold("the operator saw a tear")
        while (ended := acquisition.poll(0.1)) is None:
            pass
        assert ended.failure is not None
        assert ended.failure.message.startswith("the operator saw a tear")
        with pytest.raises(SessionError, match="the robot is held"):
            acquisition.record(SHORT.trajectory(), tmp_path / "t", Label("held"), silent)
        acquisition.release()
    events = {event.name: event.details for event in Recording(tmp_path / "s").events}
    assert events["note"]["text"] == "the lamp flickered"
    assert events["session_failed"]["guard"]["reason"] == "the operator saw a tear"


@contextmanager
def controlling_program(rig_path: Path, folder: Path) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A client that has begun its first step; with it the id of its acquisition process."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with subprocess.Popen(
        [sys.executable, CLIENT, rig_path, folder], stdout=subprocess.PIPE, text=True, env=environment
    ) as client:
        assert client.stdout is not None
        process_id = int(client.stdout.readline().split()[1])
        while not client.stdout.readline().startswith("step 1"):
            pass
        try:
            yield client, process_id
        finally:
            client.send_signal(signal.SIGKILL)
            wait_until_ended(process_id)


def wait_until_ended(process_id: int, timeout_s: float = 60.0) -> None:
    """Wait until a process has let go of its devices."""
    command = Path(f"/proc/{process_id}/cmdline")  # empty for one that has ended and was not waited for
    deadline = time.monotonic() + timeout_s
    while command.exists() and command.read_bytes():
        assert time.monotonic() < deadline, "the acquisition process outlives its client"
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        (signal.SIGKILL, "the controlling program is gone"),
        (signal.SIGSTOP, "the controlling program has been silent for "),
    ],
    ids=["killed", "frozen"],
)
def test_the_end_of_the_controlling_program_holds_the_robot(
    rig: Rig, rig_path: Path, tmp_path: Path, kind: signal.Signals, told: str
) -> None:
    with controlling_program(rig_path, tmp_path / "s") as (client, _):
        time.sleep(0.5)
        struck_s = host_time_s()
        client.send_signal(kind)
        wait_until_sealed(tmp_path / "s")
    reason, stood_s = stop_of(tmp_path / "s")
    assert told in reason
    assert stood_s > struck_s
    recording = Recording(tmp_path / "s")
    assert recording.info.state == "sealed"
    assert recording.force.host_time_ns[-1] * 1e-9 > stood_s
    assert recording.robot.position[-1][0] - REST_TOOL.position[0] < 0.005
    assert verify_checksums(tmp_path / "s") == []


def test_the_death_of_the_acquisition_process_stops_the_robot_and_loses_no_recording(
    rig: Rig, rig_path: Path, tmp_path: Path
) -> None:
    with controlling_program(rig_path, tmp_path / "s") as (client, process_id):
        time.sleep(0.5)
        os.kill(process_id, signal.SIGKILL)
        assert client.wait(60.0) != 0
    with connected(make_devices(rig)) as devices:
        deadline = time.monotonic() + 60.0
        while not (state := devices.robot.state()).stopped and time.monotonic() < deadline:
            time.sleep(0.05)
        assert state.stopped
        assert not state.moving

    recording = open_recording(tmp_path / "s")
    assert recording.info.state == "recovered"
    assert len(recording.force) > 500
    assert np.diff(recording.force.counter).max() == 1


def test_a_breach_in_the_acquisition_process_is_told_as_a_software_stop(rig: Rig, tmp_path: Path) -> None:
    tight = replace(rig, limits=replace(rig.limits, force_n=0.1))
    with Acquisition(tight) as acquisition:
        with pytest.raises(SoftwareStopError, match=r"force of .* N exceeds the limit of 0\.1 N"):
            acquisition.record(SHORT.trajectory(), tmp_path / "s", Label("tight"), silent)
        deadline = time.monotonic() + 60.0
        while acquisition.telemetry is None or not acquisition.telemetry.held:
            assert time.monotonic() < deadline, "the telemetry does not tell of the stop"
            acquisition.poll(0.05)
        assert "exceeds the limit" in acquisition.telemetry.held
    report = read_report(tmp_path / "s")
    assert report.guard["stop"]["reaction_s"] >= 0.0
    assert report.guard["stop"]["reaction_s"] <= report.guard["stop"]["standstill_s"]


@pytest.mark.skipif(sys.platform != "linux", reason="asks the kernel by /proc")
def test_the_process_listens_for_the_devices_of_its_rig_alone_and_on_their_interface(rig: Rig) -> None:
    named = {rig.robot.settings.egm.port}
    with Acquisition(rig) as acquisition:
        found = ears(acquisition.process_id)
    assert {(ear.protocol, ear.address) for ear in found} == {("udp", "127.0.0.1")}
    assert named <= {ear.port for ear in found}
    assert len(found) <= len(named) + 1, "beside the controller's stream, one socket for the box's answers"
