import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_bench import SHORT, Bench, silent

from daq.devices import connected
from daq.errors import MotionLimitError, RecordingError, SessionError, SoftwareStopError
from daq.recording.folder import read_info, verify_checksums
from daq.recording.in_use import is_in_use
from daq.recording.mcap.chunks import Rows
from daq.recording.mcap.log import McapLog
from daq.recording.reader import Recording, open_recording
from daq.rig import read_rig
from daq.session.checks import gripper_in_tissue
from daq.session.session import Label, Session, run_session
from daq.session_report import read_report
from daq.trajectories import TWIST_AND_PULL
from robot_drivers.errors import DeviceTimeoutError, MotionRefusedError
from robot_drivers.protocols import Pose, Speed, StreamStatistics, WrenchBlock


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_a_session_moves_through_every_step_and_back(bench: Bench) -> None:
    bench.run()
    inside = [gripper_in_tissue(bench.rig, pose).position for pose in bench.robot.poses]
    np.testing.assert_allclose(np.array(inside)[:, 0], [0.042, 0.044, 0.046, 0.04], atol=1e-12)
    assert bench.robot.hold_calls == 0


def test_a_turning_trajectory_turns_about_the_grippers_origin(bench: Bench) -> None:
    bench.trajectory = replace(TWIST_AND_PULL, steps=2, return_steps=0, dwell=SHORT.dwell).trajectory()
    bench.run()
    last = gripper_in_tissue(bench.rig, bench.robot.poses[-1])
    assert last.position == pytest.approx((0.044, 0, 0))
    half = np.radians(22.5)
    assert np.abs(last.quaternion_wxyz) == pytest.approx([np.cos(half), np.sin(half), 0, 0], abs=1e-12)


def test_the_folder_tells_who_what_and_with_which_devices(bench: Bench) -> None:
    bench.run()
    info = read_info(bench.folder)
    assert info.state == "sealed"
    assert info.problems == ()
    assert info.trajectory["kind"] == "pull"
    assert info.devices["camera left"].kind == "camera"
    assert info.samples["/force/wrench"] == len(Recording(bench.folder).force)
    assert verify_checksums(bench.folder) == []
    assert read_rig(bench.folder / "rig.toml").limits == bench.rig.limits
    assert (bench.folder / "calibration" / "stereo.toml").is_file()


def test_events_tell_the_measuring_windows(bench: Bench) -> None:
    bench.run()
    events = Recording(bench.folder).events
    begins = [event for event in events if event.name == "measure_begin"]
    ends = [event for event in events if event.name == "measure_end"]
    assert [(event.details["number"], event.details["phase"]) for event in begins] == [
        (0, "hold"),
        (1, "hold"),
        (2, "hold"),
        (3, "hold"),
        (4, "return_hold"),
    ]
    windows = [(end.time_ns - begin.time_ns) * 1e-9 for begin, end in zip(begins, ends, strict=True)]
    assert windows[0] >= 0.1
    assert min(windows[1:]) >= 0.05


@pytest.mark.parametrize(
    ("wrench", "told"),
    [
        ((-16.0, 0, 0, 0, 0, 0), "force of 16 N exceeds the limit of 15 N"),
        ((0, 0, 0, 0, 1.6, 0), "torque of 1.6 N·m"),
        ((np.nan, 0, 0, 0, 0, 0), "force of nan N"),
    ],
)
def test_too_large_a_wrench_holds_the_robot_and_seals_the_recording(
    bench: Bench, wrench: tuple[float, ...], told: str
) -> None:
    bench.load(*wrench)
    with pytest.raises(SoftwareStopError, match=told):
        bench.run()
    assert bench.robot.held.is_set()
    info = read_info(bench.folder)
    assert info.state == "sealed"
    assert told in info.problems[0]
    stop = next(event for event in Recording(bench.folder).events if event.name == "session_failed")
    assert stop.details["guard"]["reaction_s"] >= 0.0


def test_what_happens_after_a_stop_is_recorded_too(bench: Bench) -> None:
    bench.load(-16.0, 0, 0, 0, 0, 0)
    with pytest.raises(SoftwareStopError):
        bench.run()
    recording = Recording(bench.folder)
    failed = next(event for event in recording.events if event.name == "session_failed")
    assert recording.force.host_time_ns[-1] - failed.time_ns > 0.1e9


def test_a_force_that_changes_too_fast_holds_the_robot(bench: Bench) -> None:
    bench.rig = replace(bench.rig, limits=replace(bench.rig.limits, force_rate_n_s=1.0))
    bench.load(-14.0, 0, 0, 0, 0, 0)
    with pytest.raises(SoftwareStopError, match=r"force rate of .* N/s exceeds the limit of 1 N/s"):
        bench.run()


def test_the_guard_tells_in_the_recording_how_quick_it_was(bench: Bench) -> None:
    bench.run()
    guard = read_report(bench.folder).guard
    assert guard["blocks"] > 10
    assert 0.0 < guard["median_s"] <= guard["most_s"] <= guard["longest_s"]


def test_a_session_can_be_held_and_noted_from_another_thread(bench: Bench) -> None:
    session = Session(bench.rig, bench.devices, bench.trajectory, bench.folder, Label("test"))
    with pytest.raises(SessionError, match="nothing is being recorded"):
        session.note("too early")

    def interfere() -> None:
        session.note("the lamp flickers")
        session.hold("the operator saw a tear")

    operator = threading.Thread(target=interfere)
    bench.robot.on_the_way = operator.start
    with pytest.raises(SoftwareStopError, match="the operator saw a tear"):
        session.run(silent)
    operator.join()
    note = next(event for event in Recording(bench.folder).events if event.name == "note")
    assert note.details["text"] == "the lamp flickers"
    assert bench.robot.hold_calls == 1


def test_the_weight_of_the_tool_and_the_sensors_offset_stop_nothing(bench: Bench) -> None:
    bench.force.wrench[:] = 100.0, 50.0, 200.0, 5.0, 5.0, 5.0
    bench.run()


def test_a_saturated_sensor_holds_the_robot(bench: Bench) -> None:
    bench.robot.on_the_way = lambda: setattr(bench.force, "usable", False)
    with pytest.raises(SoftwareStopError, match="saturated or faulty"):
        bench.run()


def test_saturation_is_the_reason_whatever_a_saturated_sensor_reads(bench: Bench) -> None:
    def saturate() -> None:
        bench.force.wrench[:] = 700.0
        bench.force.usable = False

    bench.robot.on_the_way = saturate
    with pytest.raises(SoftwareStopError, match="saturated or faulty"):
        bench.run()


def test_without_a_usable_reading_at_rest_nothing_moves(bench: Bench) -> None:
    bench.force.usable = False
    with pytest.raises(SessionError, match="no usable sample at rest"):
        bench.run()
    assert bench.robot.poses == []


@pytest.mark.parametrize("stream", ["force sensor", "robot"])
def test_silence_of_a_device_holds_the_robot(bench: Bench, stream: str) -> None:
    bench.rig = replace(bench.rig, limits=replace(bench.rig.limits, communication_age_s=1.0))
    silent_device = bench.force if stream == "force sensor" else bench.robot
    bench.robot.on_the_way = silent_device.silent.set
    with pytest.raises(SoftwareStopError, match=f"{stream} has been silent for .*the limit is 1 s"):
        bench.run()
    assert bench.robot.held.is_set()


def test_leaving_the_workspace_holds_the_robot(bench: Bench) -> None:
    bench.robot.on_the_way = lambda: bench.robot.pushed_m.put(1, 0.05)
    with pytest.raises(SoftwareStopError, match="outside the workspace"):
        bench.run()


def test_a_robot_that_runs_away_from_its_step_is_held(bench: Bench) -> None:
    bench.robot.on_the_way = lambda: bench.robot.pushed_m.put(0, 0.012)
    with pytest.raises(SoftwareStopError, match=r"step of .* mm exceeds the limit of 6\.5 mm"):
        bench.run()


def test_too_fast_a_robot_is_held(bench: Bench) -> None:
    bench.rig = replace(bench.rig, limits=replace(bench.rig.limits, speed_m_s=0.02))

    def shake() -> None:
        way_m = 0.002
        while not bench.robot.held.wait(0.03):
            bench.robot.pushed_m[0], way_m = way_m, -way_m

    bench.robot.on_the_way = shake
    with pytest.raises(SoftwareStopError, match=r"speed of .* mm/s exceeds the limit of 20 mm/s"):
        bench.run()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"step_length": 0.007}, "step 1: 7.00 mm exceed the limit of 6.5 mm"),
        ({"steps": 20}, "step 16: the gripper at .* would leave the workspace"),
        ({"speed": Speed(9.0, 1.0)}, "speed of 9000 mm/s exceeds the limit"),
    ],
)
def test_a_trajectory_beyond_the_limits_is_refused_before_there_is_a_folder(
    bench: Bench, change: dict[str, object], told: str
) -> None:
    bench.trajectory = replace(SHORT, return_steps=0, **change).trajectory()
    with pytest.raises(MotionLimitError, match=told):
        bench.run()
    assert bench.robot.poses == []
    assert not bench.folder.exists()


def test_a_path_that_the_robot_cannot_follow_is_refused_before_anything_moves(bench: Bench) -> None:
    bench.robot.reach_m = 0.494
    with pytest.raises(MotionRefusedError, match="reach"):
        bench.run()
    assert bench.robot.poses == []
    assert not bench.folder.exists()


def test_a_step_that_the_robot_refuses_under_way_is_no_refusal_before_anything_moved(bench: Bench) -> None:
    def refuse() -> None:
        raise MotionRefusedError("the controller refused the motion, nothing has moved")

    def arrange(text: str, done: int, total: int) -> None:
        if done == 2:
            bench.robot.on_the_way = refuse

    with pytest.raises(SessionError, match=r"step 2 was refused under way \(the controller refused"):
        bench.run(arrange)
    assert bench.robot.hold_calls == 1
    assert len(bench.robot.poses) == 1
    assert read_info(bench.folder).state == "sealed"


def test_a_gripper_elsewhere_than_at_the_grasp_is_refused(bench: Bench) -> None:
    bench.robot.pose = Pose((0.495, 0.0, 0.2), (0.0, 1.0, 0.0, 0.0))
    with pytest.raises(SessionError, match=r"5\.0 mm and 0\.0° off the grasp"):
        bench.run()


def test_a_held_robot_is_not_moved_until_it_is_released(bench: Bench) -> None:
    bench.robot.hold()
    with pytest.raises(SessionError, match="robot is held"):
        bench.run()
    bench.robot.resume()
    bench.run()


def test_a_session_is_in_use_from_its_beginning_until_it_is_sealed(bench: Bench) -> None:
    in_use: dict[str, bool] = {}

    def look(text: str, done: int, total: int) -> None:
        in_use[text] = is_in_use(bench.folder / "rig.toml")

    bench.run(look)
    assert "checking and sealing the recording" in in_use
    assert all(in_use.values())
    assert not is_in_use(bench.folder / "rig.toml")


def test_an_interrupt_holds_the_robot_and_seals(bench: Bench) -> None:
    def interrupt(text: str, done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_session(bench.rig, bench.devices, bench.trajectory, bench.folder, Label("test"), interrupt)
    assert bench.robot.held.is_set()
    assert read_info(bench.folder).problems == ("interrupted by the operator",)
    assert len(Recording(bench.folder).force) > 0


def test_a_failing_device_ends_the_session_with_its_own_words(bench: Bench) -> None:
    def fail(timeout_s: float) -> WrenchBlock:
        time.sleep(0.2)
        raise DeviceTimeoutError("force sensor: cable out")

    bench.force.read = fail  # type: ignore[method-assign] # the fake breaks in this test
    with pytest.raises((DeviceTimeoutError, SessionError), match=r"cable out|no usable sample"):
        bench.run()
    assert bench.robot.held.is_set()


def test_what_befell_the_messages_before_a_session_is_not_told_of_it(bench: Bench) -> None:
    """Devices count from connecting, sessions come and go."""
    counted = StreamStatistics(lost=7, malformed=3, restarts=1)
    bench.robot.counts = counted
    bench.robot.on_the_way = None
    bench.run()
    assert read_info(bench.folder).problems == ()


def test_what_befell_the_messages_during_a_session_is_told_by_device(bench: Bench) -> None:
    bench.robot.counts = StreamStatistics(lost=7, malformed=3, restarts=1)

    def lose(words: str, done: int, total: int) -> None:
        bench.robot.counts = StreamStatistics(lost=9, malformed=4, restarts=2)

    bench.run(lose)
    assert read_info(bench.folder).problems == (
        "robot: 2 samples lost on the way",
        "robot: 1 messages not understood and left out",
        "robot: 1 times its stream or its clock began anew",
    )


def test_a_problem_is_known_while_the_session_runs_and_nothing_that_comes_after_it_is_one(
    bench: Bench,
) -> None:
    session = Session(bench.rig, bench.devices, bench.trajectory, bench.folder, Label("test"))
    known: dict[str, tuple[str, ...]] = {}

    def look(words: str, done: int, total: int) -> None:
        known[words.partition(" ")[0]] = session.problems()
        if words.startswith("step 1:"):
            bench.force.counts = StreamStatistics(lost=3)
            session.mark("the light was off")
        if words.startswith("checking"):
            bench.devices.cameras["left"].counts = StreamStatistics(lost=186)  # type: ignore[attr-defined]
            known["later"] = session.problems()

    info = session.run(look)
    assert known["zeroing"] == ()
    assert known["step"] == known["later"] == info.problems
    assert info.problems == ("force sensor: 3 samples lost on the way", "the light was off")


def test_a_stop_at_the_controller_is_noticed_though_the_robot_stands(bench: Bench) -> None:
    """After the last motion nobody orders another one that the controller could refuse."""
    state = bench.robot.state
    bench.robot.state = lambda: replace(  # type: ignore[method-assign] # somebody presses a button in this test
        state(), ready=not bench.robot.poses and state().ready, message="motors are off"
    )
    with pytest.raises(SessionError, match=r"stopped at its controller while it stood \(motors are off\)"):
        bench.run()
    assert bench.robot.held.is_set()
    assert "motors are off" in read_info(bench.folder).problems[0]


FULL_DISK = """
import resource, sys
from pathlib import Path
sys.path[:0] = {paths!r}
from daq.errors import RecordingError
from session_bench import Bench
bench = Bench(Path({folder!r}))
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
try:
    bench.run()
except RecordingError as error:
    print("held" if bench.robot.held.is_set() else "not held", error)
"""


def test_a_full_disk_holds_the_robot_and_keeps_what_was_written(tmp_path: Path) -> None:
    here = Path(__file__)
    program = FULL_DISK.format(paths=[str(here.parents[2]), str(here.parent)], folder=str(tmp_path))
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.startswith("held"), done.stdout + done.stderr
    assert "cannot be" in done.stdout
    recording = open_recording(tmp_path / "session")
    assert recording.info.state in {"sealed", "recovered"}
    assert len(recording.force) > 50
    assert np.all(np.diff(recording.force.counter) == 1)


def test_a_disk_that_fills_in_the_middle_of_a_motion_holds_the_robot_there(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The motion goes on until somebody holds it, and nobody asks the recorder meanwhile."""
    full = threading.Event()
    append = McapLog.append

    def append_or_fail(log: McapLog, *batch: Rows) -> None:
        if full.is_set():
            raise OSError(28, "No space left on device")
        append(log, *batch)

    monkeypatch.setattr(McapLog, "append", append_or_fail)
    bench.robot.on_the_way = full.set
    with pytest.raises(RecordingError, match="No space left"):
        bench.run()
    assert bench.robot.held.is_set()
    assert bench.robot.poses == []


def test_an_existing_folder_is_never_written_into(bench: Bench) -> None:
    bench.folder.mkdir()
    with pytest.raises(Exception, match="name a new folder"):
        bench.run()
    assert list(bench.folder.iterdir()) == []


def test_all_devices_are_closed_in_the_end(bench: Bench) -> None:
    with connected(bench.devices):
        pass
    devices = (bench.force, bench.robot, *bench.devices.cameras.values())
    assert all(device.closed for device in devices)
