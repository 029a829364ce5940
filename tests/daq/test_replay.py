import json
import time
from pathlib import Path

import numpy as np
import pytest
from synthetic_session import SyntheticSession

from daq.cli import main
from daq.errors import RecordingError
from daq.recording.folder import SessionInfo, seal_session, write_info
from daq.recording.reader import Recording
from daq.recording.recorder import Recorder
from daq.replay import ReplayClock, replayed
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from robot_drivers.errors import MotionRefusedError
from robot_drivers.protocols import Pose, Speed

POSES = tuple(Pose((0.04 + way, 0.0, 0.0)) for way in (0.0, 0.003))


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("replay") / "session"
    SyntheticSession(POSES, SpringPhantom(GRASP_CENTRE, placed_beads(3)), lost=(1.2, 1.25)).write(folder)
    seal_session(folder)
    return folder


def wait_for_the_end(clock: ReplayClock) -> None:
    while not clock.finished:
        time.sleep(0.01)


def wait_for_all_of(recording: Recording, recorder: Recorder) -> None:
    """Wait until another recorder has written every sample of a recording."""
    counts = {"force": len(recording.force), "robot": len(recording.robot)}
    counts |= {f"camera/{name}": len(recording.images(name)) for name in recording.cameras}
    while any(recorder.written().get(stream, 0) < count for stream, count in counts.items()):
        time.sleep(0.01)


def test_a_recorded_replay_is_the_recording_again(session: Path, tmp_path: Path) -> None:
    original = Recording(session)
    write_info(tmp_path, SessionInfo("again", "P1", 1))
    devices, clock = replayed(original, speed=2.0)
    with Recorder(tmp_path, devices) as recorder:
        wait_for_the_end(clock)
        wait_for_all_of(original, recorder)
    again = Recording(tmp_path)
    for name in ("counter", "device_time_s", "status", "usable", "wrench"):
        np.testing.assert_array_equal(getattr(again.force, name), getattr(original.force, name))
    for name in ("counter", "device_time_s", "position", "quaternion_wxyz", "joints", "moving"):
        np.testing.assert_array_equal(getattr(again.robot, name), getattr(original.robot, name))
    spacing = np.diff(original.force.host_time_ns) - 2.0 * np.diff(again.force.host_time_ns)
    assert np.abs(spacing).max() <= 2
    for camera in original.cameras:
        before, after = original.images(camera), again.images(camera)
        np.testing.assert_array_equal(after.counter, before.counter)
        for index in range(len(before)):
            assert after.pixel_format(index) == before.pixel_format(index)
            np.testing.assert_array_equal(after.image(index), before.image(index))


def test_samples_come_when_they_are_due(session: Path) -> None:
    recording = Recording(session)
    stamps = recording.force.host_time_ns
    devices, clock = replayed(recording, speed=1.0)
    started = time.monotonic()
    received = 0
    while clock.position_s < 0.5:
        received += len(devices.force_sensor.read(0.05))
        due = np.searchsorted(stamps, clock.position_ns)
        assert received <= due + 1
    assert time.monotonic() - started > 0.4
    assert received + len(devices.force_sensor.read(0.0)) >= 400


def test_a_seek_goes_on_from_there_and_back_again(session: Path) -> None:
    original = Recording(session)
    devices, clock = replayed(original)
    for position_s in (2.0, 0.25):
        clock.seek(position_s)
        block = devices.force_sensor.read(0.5)
        asked_ns = clock.begin_ns + round(position_s * 1e9)
        assert (
            block.counter[0] == original.force.counter[np.searchsorted(original.force.host_time_ns, asked_ns)]
        )
    with pytest.raises(RecordingError, match="99 s is not in the session, which lasts"):
        clock.seek(99.0)


def test_the_counter_tells_what_is_missing(session: Path) -> None:
    devices, clock = replayed(Recording(session), speed=50.0)
    wait_for_the_end(clock)
    devices.force_sensor.read(0.0)
    told = devices.force_sensor.statistics()
    assert (told.received, told.lost) == (2950, 50)
    assert len(devices.force_sensor.read(0.0)) == 0


def test_the_robot_reports_and_never_moves(session: Path) -> None:
    devices, clock = replayed(Recording(session))
    clock.seek(2.5)
    state = devices.robot.state()
    assert not state.ready
    assert state.T_base_tool.position[0] == pytest.approx(0.493, abs=1e-4)
    with pytest.raises(MotionRefusedError, match="is a recording"):
        devices.robot.move_linear(state.T_base_tool, Speed(0.01, 0.1), 1.0)


def test_an_empty_session_and_a_speed_of_zero_are_refused(tmp_path: Path, session: Path) -> None:
    with pytest.raises(RecordingError, match="speed of 0"):
        replayed(Recording(session), speed=0.0)


def test_the_command_line_tells_what_passed(session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(session), "--speed", "10", "--from", "1.0", "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["missing"]["force sensor"] == 50
    assert "tool at (49" in err
