import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_session import START_NS, rendered_scene

from daq.frames import compose, inverse
from daq.progress import silent
from daq.recording.folder import SessionInfo, seal_session, verify_checksums, write_info
from daq.recording.mcap import schemas
from daq.recording.mcap.log import McapLog
from daq.recording.messages.codec import compressed
from daq.recording.messages.rows import EventRows, FrameRows, PoseRows, WrenchRows
from daq.recording.reader import Recording
from daq.rig import read_rig, write_rig
from daq.session_report import SessionReport, StreamQuality, read_report, report_session, write_report
from daq.synchronisation.alignment import check_alignment
from daq.virtual_rig.layout import FRAMES, GRASP_CENTRE, Addresses, placed_beads, rig_description
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.rendering.scene import flea2_pair
from robot_drivers.protocols import Frame, Pose, PoseBlock, WrenchBlock

PHANTOM = SpringPhantom(GRASP_CENTRE, placed_beads(1))
MOVES_S = (0.8, 1.8, 2.8, 3.8, 4.8)  # half a second each, 2 mm out; the last one back
DURATION_S = 6.0
FORCE_DRIFT, ROBOT_DRIFT = 40e-6, -25e-6


def way_m(time_s: np.ndarray) -> np.ndarray:
    """Of the gripper: smooth steps."""
    share = np.clip((np.asarray(time_s)[..., None] - MOVES_S) / 0.5, 0.0, 1.0)
    smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return smooth @ np.array([0.002, 0.002, 0.002, 0.002, -0.008])


def received(time_s: np.ndarray, delay_s: float, seed: int) -> np.ndarray:
    late = np.random.default_rng(seed).exponential(delay_s, len(time_s))
    return START_NS + np.rint(np.maximum.accumulate(time_s + late) * 1e9).astype(np.int64)


class MovingSession:
    """A recording of the moves, whose force is ``force_late_s`` behind the robot; some of it is lost."""

    def __init__(self, force_late_s: float = 0.0, lost_samples: int = 0, images: bool = False) -> None:
        self.images = images
        self.force_late_s = force_late_s
        self.lost_samples = lost_samples

    def write(self, folder: Path) -> Recording:
        (folder / "calibration").mkdir(parents=True)
        flea2_pair().save(folder / "calibration" / "stereo.toml")
        addresses = Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2"))
        write_rig(rig_description(addresses, folder / "calibration" / "stereo.toml"), folder / "rig.toml")
        write_info(folder, SessionInfo("moving", "P1", 1, trajectory={"kind": "pull"}))
        with McapLog(folder / "signals.mcap") as log:
            self._write_events(log)
            self._write_force(log)
            self._write_robot(log)
        with McapLog(folder / "cameras.mcap") as log:
            self._write_images(log)
        return Recording(folder)

    def _write_events(self, log: McapLog) -> None:
        rows = EventRows(log.add_channel("/events", schemas.EVENT))
        for number, begin_s in enumerate(MOVES_S):
            for name, time_s in (("move_begin", begin_s), ("move_end", begin_s + 0.5)):
                log.append(rows.pack({"event": name, "number": number}, START_NS + round(time_s * 1e9), 0))
        latency = {"blocks": 1200, "median_s": 2e-3, "most_s": 4e-3, "longest_s": 9e-3}
        log.append(rows.pack({"event": "guard_latency", **latency}, START_NS, 0))

    def _write_force(self, log: McapLog) -> None:
        time_s = np.arange(0.0, DURATION_S, 1e-3)
        wrench = np.random.default_rng(1).normal(0.0, 6e-3, (len(time_s), 6))
        wrench[:, 0] -= 110.0 * way_m(time_s - self.force_late_s)
        kept = np.ones(len(time_s), dtype=np.bool_)
        kept[2000 : 2000 + self.lost_samples] = False
        block = WrenchBlock(
            counter=np.flatnonzero(kept),
            device_time_s=time_s[kept] * (1 + FORCE_DRIFT),
            host_time_ns=received(time_s, 100e-6, seed=2)[kept],
            status=np.zeros(kept.sum(), dtype=np.int64),
            usable=np.ones(kept.sum(), dtype=np.bool_),
            wrench=wrench[kept],
        )
        channels = (
            log.add_channel("/force/wrench", schemas.WRENCH),
            log.add_channel("/force/device", schemas.DEVICE_STAMP),
        )
        log.append(WrenchRows(*channels, "force_sensor").pack(block, 0))

    def _write_robot(self, log: McapLog) -> None:
        time_s = np.arange(0.0, DURATION_S, 0.004032)
        T_gripper_tool = inverse(FRAMES.T_tool_gripper.pose)
        tools = [
            compose(compose(FRAMES.T_base_tissue.pose, self._gripper(moment)), T_gripper_tool)
            for moment in time_s
        ]
        block = PoseBlock(
            counter=np.arange(len(time_s)),
            device_time_s=100.0 + time_s * (1 + ROBOT_DRIFT),
            host_time_ns=received(time_s, 300e-6, seed=3),
            position=np.array([tool.position for tool in tools]),
            quaternion_wxyz=np.array([tool.quaternion_wxyz for tool in tools]),
            joints=np.zeros((len(time_s), 6)),
            moving=np.zeros(len(time_s), dtype=np.bool_),
        )
        rows = PoseRows(
            log.add_channel("/robot/pose", schemas.POSE),
            log.add_channel("/robot/joints", schemas.JOINT_STATE),
            log.add_channel("/robot/device", schemas.DEVICE_STAMP),
            "robot_base",
        )
        log.append(rows.pack(block, 0))

    def _gripper(self, time_s: float) -> Pose:
        x, y, z = GRASP_CENTRE
        return Pose((x + float(way_m(np.array(time_s))), y, z))

    def _write_images(self, log: McapLog) -> None:
        pair = flea2_pair()
        for side, (name, camera) in enumerate((("left", pair.left), ("right", pair.right))):
            rows = FrameRows(
                log.add_channel(f"/camera/{name}/image", schemas.COMPRESSED_IMAGE),
                log.add_channel(f"/camera/{name}/image_raw", schemas.IMAGE),
                log.add_channel(f"/camera/{name}/device", schemas.DEVICE_STAMP),
                f"camera_{name}",
            )
            time_s = np.arange(0.05, DURATION_S if self.images else 0.0, 0.1)
            stamps = received(time_s, 1e-3, seed=4 + side)
            for number, moment in enumerate(time_s):
                beads = PHANTOM.solve(self._gripper(moment)).beads
                image = rendered_scene(camera, side).render(beads, number)
                frame = Frame(number, 50.0 + moment, int(stamps[number]), "mono8", image)
                log.append(rows.pack(compressed(frame), number))


@pytest.fixture(scope="module")
def report(recording: Recording) -> SessionReport:
    return report_session(recording, silent)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return MovingSession(lost_samples=40, images=True).write(tmp_path_factory.mktemp("moving") / "session")


def test_the_report_tells_rates_losses_and_drifts(report: SessionReport) -> None:
    streams = report.streams
    assert set(streams) == {"force", "robot", "camera left", "camera right"}
    force, robot, camera = streams["force"], streams["robot"], streams["camera left"]
    assert (force.samples, force.missing, force.gaps, force.resets) == (5960, 40, 1, 0)
    assert force.longest_gap_s == pytest.approx(0.041, abs=1e-4)
    assert force.drift_ppm == pytest.approx(FORCE_DRIFT * 1e6, abs=2.0)
    assert (robot.missing, robot.gaps) == (0, 0)
    assert robot.period_s == pytest.approx(0.004032, rel=1e-4)
    assert robot.drift_ppm == pytest.approx(ROBOT_DRIFT * 1e6, abs=10.0)
    assert robot.delay_s[0] == pytest.approx(300e-6 * np.log(2), rel=0.2)  # the median of the jitter
    assert camera.period_s == pytest.approx(0.1, rel=1e-3)


def test_the_guard_tells_how_quick_it_was(report: SessionReport) -> None:
    assert report.guard["longest_s"] == 9e-3
    assert "guard: force checked within 4.0 ms (99.9 %), 9.0 ms at most" in report.lines()


def test_streams_that_belong_together_are_told_so(report: SessionReport) -> None:
    for alignment in report.alignments:
        assert alignment.remark == ""
        assert abs(alignment.lag_s) < 1.5e-3
        assert alignment.std_s < 1e-3
        assert alignment.explained > 0.99
    assert report.warnings == ()


def test_a_force_that_is_late_is_found_and_warned_of(tmp_path: Path) -> None:
    report = report_session(MovingSession(force_late_s=0.006).write(tmp_path / "s"), silent)
    force = report.alignments[0]
    assert force.lag_s == pytest.approx(0.006, abs=0.5e-3)
    assert report.warnings == (f"{force}: beyond 2 ms; calibrate the time",)


def test_cameras_that_are_early_are_found(recording: Recording) -> None:
    rig = read_rig(recording.folder / "rig.toml")
    # taking 20 ms too many off their stamps makes them early
    early = replace(rig, latencies=replace(rig.latencies, cameras_s=0.02))
    cameras = check_alignment(recording, early, silent)[1]
    assert cameras.lag_s == pytest.approx(-0.02, abs=1.5e-3)
    assert cameras.misaligned


def test_the_report_lies_beside_what_is_sealed_and_can_be_made_anew(tmp_path: Path) -> None:
    recording = MovingSession().write(tmp_path / "s")
    report = write_report(recording, silent)
    seal_session(recording.folder)
    assert read_report(recording.folder) == report
    json.loads((recording.folder / "derived" / "report.json").read_text(), parse_constant=pytest.fail)
    (recording.folder / "derived" / "report.json").unlink()
    assert verify_checksums(recording.folder) == []
    assert write_report(Recording(recording.folder), silent) == report


def test_what_cannot_be_told_is_said(tmp_path: Path) -> None:
    (tmp_path / "s").mkdir()
    write_info(tmp_path / "s", SessionInfo("empty", "P1", 1))
    for name in ("signals.mcap", "cameras.mcap"):
        McapLog(tmp_path / "s" / name).close()
    report = write_report(Recording(tmp_path / "s"), silent)
    assert report.streams == {}
    assert "rig.toml" in report.alignments[0].remark
    assert read_report(tmp_path / "s").alignments[0].remark == report.alignments[0].remark


def test_only_a_stream_whose_clock_began_anew_bears_a_warning_of_it() -> None:
    steady = StreamQuality(100, 0, 0.004, 0, 0.0, 0, 1.0, 0.0, (0.0, 0.0, 0.0, 0.0))
    report = SessionReport({"force": steady, "robot": replace(steady, resets=1)}, {}, ())
    (warning,) = report.warnings
    assert warning.startswith("robot: its clock jumped or began anew 1 times")
