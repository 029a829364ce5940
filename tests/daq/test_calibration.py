"""Calibrations of sessions and views whose truth is known, and which of them is in force."""

import math
import shutil
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_session import START_NS, SyntheticSession

from daq.calibration.cameras import calibrate_cameras, calibrate_stereo
from daq.calibration.collected_views import BoardViews, lying_on_phantom
from daq.calibration.force import calibrate_force
from daq.calibration.latencies import calibrate_time
from daq.calibration.registration import calibrate_robot, register_landmarks
from daq.calibration.tool import ToolCalibration
from daq.calibration_files.in_force import calibrations_in_force
from daq.calibration_files.keeping import keep
from daq.calibration_files.outcome import Figure, Outcome
from daq.calibration_files.record import read_record
from daq.calibration_files.results import ForceResult, TimeResult, ToolResult
from daq.errors import CalibrationError, RigError
from daq.frames import rotation
from daq.progress import silent
from daq.recording.mcap.log import McapLog
from daq.recording.reader import Recording
from daq.rig import Latencies, Rig, read_rig, write_rig
from daq.timing.event_times import estimate_event_times
from daq.trajectories import Trajectory
from daq.trajectories.routines import marker_poses, tare_poses
from daq.virtual_rig.layout import (
    FRAMES,
    GRASP_CENTRE,
    SPECIMEN,
    T_FLANGE_TOOL,
    TOOL,
    Addresses,
    rig_description,
)
from daq.virtual_rig.operator import BOARD, BOARD_AT_REST, board_pose, touching_pose
from daq.virtual_rig.physics.free_air import FreeAir
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.rendering.board_scene import BoardScene
from daq.virtual_rig.rendering.scene import flea2_pair
from daq.vision.planar import PlanarView
from robot_drivers.protocols import Pose

MARKER = (-0.012, 0.004, 0.015)
NOW = datetime(2026, 5, 4, 12, 0, tzinfo=UTC)
FORCE_LATE_S, CAMERAS_LATE_S = 0.0123, 0.041


def measured(trajectory: Trajectory) -> list[Pose]:
    """``T_tissue_gripper`` of every measuring window, the gripper's axes those of the tissue at rest."""
    return [
        Pose(
            tuple(np.add(GRASP_CENTRE, step.T_rest_gripper.position).tolist()),
            step.T_rest_gripper.quaternion_wxyz,
        )
        for step in trajectory.steps
        if step.measure_s > 0
    ]


def figure(outcome: Outcome[object], name: str) -> Figure:
    return next(one for one in outcome.figures if name in one.name)


def test_weight_centre_and_offset_of_the_tool_are_found(tmp_path: Path) -> None:
    session = SyntheticSession(measured(tare_poses()), FreeAir((), MARKER), frame_rate=0.01)
    outcome = calibrate_force(Recording(session.write(tmp_path / "s")))
    found = outcome.result
    assert outcome.acceptable
    assert found.mass_kg == pytest.approx(TOOL.mass_kg, abs=4 * found.mass_std_kg)
    assert found.mass_std_kg < 2e-4
    assert np.abs(np.subtract(found.centre_m, TOOL.centre_m)).max() < 5e-5
    np.testing.assert_allclose(found.offset, session.offset, atol=2e-3)
    np.testing.assert_allclose(found.noise_std, session.noise, rtol=0.05)


def test_one_orientation_does_not_tell_the_tool(tmp_path: Path) -> None:
    session = SyntheticSession(measured(tare_poses())[:2], FreeAir((), MARKER), frame_rate=0.01)
    with pytest.raises(CalibrationError, match="add poses in which gravity points along"):
        calibrate_force(Recording(session.write(tmp_path / "s")))


def test_robot_and_cameras_are_registered_by_a_marker_on_the_gripper(tmp_path: Path) -> None:
    poses = measured(marker_poses())
    session = SyntheticSession(poses, FreeAir(SPECIMEN.fiducials_m[:4], MARKER), frame_rate=2.0)
    outcome = calibrate_robot(Recording(session.write(tmp_path / "s")))
    found, truth = outcome.result, FRAMES.T_base_tissue
    error = np.subtract(found.T_base_tissue.position_m, truth.position_m)
    assert outcome.acceptable, outcome.describe()
    assert np.abs(error).max() < 4 * found.position_std_m
    assert found.position_std_m < 1e-4
    turn = rotation(found.T_base_tissue.quaternion_wxyz).magnitude()
    assert math.degrees(turn) < 4 * figure(outcome, "turn").value
    in_tool = rotation(FRAMES.T_tool_gripper.quaternion_wxyz).apply(MARKER)
    np.testing.assert_allclose(found.marker_in_tool_m, in_tool, atol=2e-4)
    assert figure(outcome, "not explained").value < 3e-5


def test_without_a_marker_nothing_is_registered(tmp_path: Path) -> None:
    session = SyntheticSession(measured(marker_poses())[:3], FreeAir((), (0.5, 0.5, 0.5)), frame_rate=2.0)
    with pytest.raises(CalibrationError, match="single moving marker is seen in 0 of 3 poses"):
        calibrate_robot(Recording(session.write(tmp_path / "s")))


def test_touched_landmarks_register_the_tissue_frame() -> None:
    rng = np.random.default_rng(1)
    landmarks = np.array([(x, y, 0.005) for x in (-0.05, 0.05) for y in (-0.05, 0.05)])
    turn = Rotation.from_rotvec([0.1, -0.2, 0.7])
    touched = turn.apply(landmarks) + np.array([0.45, 0.02, 0.2]) + rng.normal(0.0, 1e-4, landmarks.shape)
    outcome = register_landmarks(touched, landmarks, flea2_pair())
    found = outcome.result
    np.testing.assert_allclose(
        found.T_base_tissue.position_m, (0.45, 0.02, 0.2), atol=4 * found.position_std_m
    )
    assert outcome.acceptable
    with pytest.raises(CalibrationError, match="do not lie on one line"):
        register_landmarks(touched[:2].repeat(2, axis=0), landmarks[:2].repeat(2, axis=0), flea2_pair())


@dataclass
class Swaying(SyntheticSession):
    """Rest, a triangular sway of 2.5 mm at 1.1 Hz, rest; force and cameras are stamped late by known times."""

    moving_s: float = 6.0
    late_s: float = 0.0

    def __post_init__(self) -> None:
        self.poses = (Pose(GRASP_CENTRE),) * 2

    @property
    def _duration_s(self) -> float:
        return self.moving_s + 3.0

    def _pose_at(self, time_s: float) -> Pose:
        x, y, z = GRASP_CENTRE
        since = min(max(time_s - self.late_s - 1.5, 0.0), self.moving_s)
        phase = (1.1 * since + 0.25) % 1.0
        way = 0.0 if since in (0.0, self.moving_s) else 2.5e-3 * (1.0 - 4.0 * abs(phase - 0.5))
        return Pose((x + way, y, z))

    def _window_begin_s(self, row: int) -> float:
        return (0.0, self.moving_s + 2.0)[row]

    def _write_force(self, log: McapLog) -> None:
        self.late_s = FORCE_LATE_S
        super()._write_force(log)
        self.late_s = 0.0

    def _write_images(self, log: McapLog) -> None:
        self.late_s = CAMERAS_LATE_S
        super()._write_images(log)
        self.late_s = 0.0


@pytest.fixture(scope="module")
def swaying(tmp_path_factory: pytest.TempPathFactory) -> Path:
    session = Swaying((), SpringPhantom(GRASP_CENTRE, SPECIMEN.fiducials_m), frame_rate=6.0)
    return session.write(tmp_path_factory.mktemp("swaying") / "s")


def take_a_camera_out(session: Path, *, planar: bool) -> None:
    """Leave the left camera alone in the rig file of a session."""
    rig = replace(read_rig(session / "rig.toml"), stereo_calibration=None)
    flea2_pair().left.save(session / "calibration" / "camera.toml")
    view = PlanarView(session / "calibration" / "camera.toml", 2e-4) if planar else None
    write_rig(replace(rig, cameras=rig.cameras[:1], planar_view=view), session / "rig.toml")


@pytest.mark.parametrize("cameras", ["a pair", "an only one"])
def test_latencies_are_found_to_half_a_millisecond(swaying: Path, tmp_path: Path, cameras: str) -> None:
    session = Path(shutil.copytree(swaying, tmp_path / "s"))
    if cameras == "an only one":
        take_a_camera_out(session, planar=True)
    recording = Recording(session)
    outcome = calibrate_time(recording, silent)
    found = {stream.stream: stream for stream in outcome.result.streams}
    # the least delay of the transport, which no stamp tells, is part of a latency
    images = recording.images("left")
    stamped = estimate_event_times(images.device_time_s, images.host_time_ns).time_ns
    exposed = START_NS + (images.device_time_s - 50.0) * 1e9
    transport_s = float(np.mean(stamped - exposed)) * 1e-9
    assert found["force sensor"].latency_s == pytest.approx(FORCE_LATE_S, abs=5e-4)
    assert found["cameras"].latency_s == pytest.approx(CAMERAS_LATE_S + transport_s, abs=5e-4)
    for stream in found.values():
        assert stream.std_s < 5e-4
        best = stream.lags_s[int(np.argmax(stream.correlation))]
        assert best == pytest.approx(stream.latency_s, abs=2e-3)
    assert outcome.acceptable


def test_of_a_camera_that_measures_nothing_no_latency_is_sought_and_the_rig_files_stays(
    swaying: Path, tmp_path: Path
) -> None:
    session = Path(shutil.copytree(swaying, tmp_path / "s"))
    take_a_camera_out(session, planar=False)
    outcome = calibrate_time(Recording(session), silent)
    assert [stream.stream for stream in outcome.result.streams] == ["force sensor"]
    assert outcome.acceptable
    known = replace(rig(tmp_path), latencies=Latencies(force_s=0.0, cameras_s=0.05))
    keep(outcome, known.calibration, known.name, {}, accepted=True, now=NOW)
    applied = calibrations_in_force(known, {}, NOW).apply(known).latencies
    assert applied.force_s == outcome.result.streams[0].latency_s
    assert applied.cameras_s == 0.05


def test_the_tool_centre_is_found_by_turning_about_a_point() -> None:
    centre = (0.0006, -0.0004, 0.0009)
    collected = ToolCalibration(T_FLANGE_TOOL)
    for number in range(9):
        told = collected.add(touching_pose(number, centre))
    assert told.touches == 9
    outcome = collected.finish()
    assert outcome.acceptable
    np.testing.assert_allclose(outcome.result.gripper_in_tool_m, centre, atol=4 * outcome.result.std_m)
    np.testing.assert_allclose(
        outcome.result.gripper_in_flange_m,
        np.add(centre, T_FLANGE_TOOL.position),
        atol=4 * outcome.result.std_m,
    )


def test_touches_in_one_orientation_are_refused_and_a_slip_is_rejected() -> None:
    collected = ToolCalibration(T_FLANGE_TOOL)
    for _ in range(6):
        collected.add(touching_pose(0))
    with pytest.raises(CalibrationError, match=r"turn by 0\.0°"):
        collected.finish()
    slipped = ToolCalibration(T_FLANGE_TOOL)
    for number in range(6):
        touch = touching_pose(number)
        x, y, z = touch.position
        slipped.add(Pose((x + 0.003 * (number == 3), y, z), touch.quaternion_wxyz))
    assert not figure(slipped.finish(), "off one point").passed


@pytest.fixture(scope="module")
def board() -> BoardViews:
    """Fourteen views of the board by both cameras; a dark image in between is not taken."""
    pair = flea2_pair()
    scenes = [BoardScene(camera, BOARD) for camera in (pair.left, pair.right)]
    collected = BoardViews(BOARD)
    coverage = [0.0]
    for number in range(14):
        left, right = (
            scene.render(board_pose(number), 2 * number + side) for side, scene in enumerate(scenes)
        )
        told = collected.add(left, right)
        assert told.problem == ""
        assert told.views == number + 1
        coverage.append(told.coverage[0])
    assert coverage == sorted(coverage)
    dark = np.zeros((964, 1288), np.uint8)
    told = collected.add(dark, dark)
    assert "0 board corners" in told.problem
    assert told.views == 14
    return collected


def test_both_lenses_are_calibrated_from_views_of_a_board(board: BoardViews) -> None:
    outcome = calibrate_cameras(board)
    truth = flea2_pair()
    assert outcome.acceptable, outcome.describe()
    for lens, camera in ((outcome.result.left, truth.left), (outcome.result.right, truth.right)):
        assert lens.focal_length[0] == pytest.approx(camera.focal_length[0], rel=3e-3)
        assert lens.distortion[0] == pytest.approx(camera.distortion[0], abs=5 * lens.std[4])
        assert lens.rms_px < 0.15
    assert figure(outcome, "left coverage").value > 0.7


def test_the_pair_is_calibrated_in_the_frame_of_the_phantom(board: BoardViews) -> None:
    outcome = calibrate_stereo(board, BOARD_AT_REST)
    truth = flea2_pair()
    assert outcome.acceptable, outcome.describe()
    assert outcome.result.baseline_m == pytest.approx(truth.baseline_m, rel=1e-3)
    np.testing.assert_allclose(outcome.result.left.centre, truth.left.centre, atol=1e-3)
    assert figure(outcome, "held-out scale").value < 5e-4


def test_too_few_views_are_told_with_what_to_do() -> None:
    with pytest.raises(CalibrationError, match="0 views were taken, 12 are needed"):
        calibrate_cameras(BoardViews(BOARD))


def rig(folder: Path) -> Rig:
    described = rig_description(
        Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2")), folder / "stereo.toml"
    )
    return replace(described, calibration=folder / "calibration")


def test_the_board_lies_on_the_middle_of_the_phantom(tmp_path: Path) -> None:
    placed = lying_on_phantom(BOARD, rig(tmp_path))
    assert placed.position == pytest.approx(BOARD_AT_REST.position)
    middle = np.array([BOARD.columns, BOARD.rows, 0]) * BOARD.square_m / 2
    on_tissue = rotation(placed.quaternion_wxyz).apply(middle) + placed.position
    np.testing.assert_allclose(on_tissue, [0.0, 0.0, 0.005], atol=1e-12)


def forced(mass_kg: float, std_kg: float = 1e-4) -> Outcome[ForceResult]:
    six = (0.0,) * 6
    result = ForceResult(mass_kg, std_kg, (0.0, 0.0, 0.06), (1e-5,) * 3, six, six, six)
    return Outcome(
        "force", result, (Figure("mass, standard deviation", std_kg, "kg", most=0.005),), lambda plot: None
    )


SERIALS = {"force sensor": "FT1", "robot": "140-1"}


def test_a_kept_calibration_reads_back_and_has_a_plot(tmp_path: Path) -> None:
    path = keep(forced(0.36), tmp_path, "virtual rig", {"force sensor": "FT1"}, accepted=True, now=NOW)
    record = read_record(path)
    assert path.name == "force_2026-05-04_120000.toml"
    assert path.with_suffix(".png").read_bytes()[:4] == b"\x89PNG"
    assert record.result == forced(0.36).result
    assert record.verdict == "accepted"
    assert record.figures[0].passed
    assert datetime.fromisoformat(record.expires) - NOW == timedelta(days=30)


def test_the_newest_accepted_calibration_is_in_force(tmp_path: Path) -> None:
    described = rig(tmp_path)
    for day, mass_kg, accepted in ((0, 0.36, True), (1, 0.37, True), (2, 0.5, False)):
        keep(
            forced(mass_kg),
            described.calibration,
            described.name,
            {"force sensor": "FT1"},
            accepted=accepted,
            now=NOW + timedelta(days=day),
        )
    keep(forced(0.9), described.calibration, "another rig", {}, accepted=True, now=NOW + timedelta(days=3))
    found = calibrations_in_force(described, SERIALS, NOW + timedelta(days=4))
    assert found.warnings == ()
    assert found.apply(described).tool.mass_kg == 0.37
    assert found.describe() == {"force": "force_2026-05-05_120000.toml, expires 2026-06-04T12:00:00+00:00"}
    assert calibrations_in_force(replace(described, calibration=None), SERIALS).files == {}


def test_an_expired_calibration_is_warned_of_and_one_of_another_sensor_is_not_used(tmp_path: Path) -> None:
    described = rig(tmp_path)
    keep(forced(0.36), described.calibration, described.name, {"force sensor": "FT1"}, accepted=True, now=NOW)
    late = calibrations_in_force(described, SERIALS, NOW + timedelta(days=31))
    assert late.apply(described).tool.mass_kg == 0.36
    assert late.warnings == (
        "force_2026-05-04_120000.toml expired on 2026-06-03T12:00:00+00:00; calibrate force again",
    )
    other = calibrations_in_force(described, {"force sensor": "FT2"}, NOW)
    assert other.apply(described).tool == described.tool
    assert "it is of force sensor FT1, and FT2 is connected" in other.warnings[0]


def test_every_kind_goes_before_what_the_rig_file_says(tmp_path: Path, board: BoardViews) -> None:
    described = rig(tmp_path)
    tool = Outcome("tool", ToolResult((1e-3, 0.0, 0.0), (1e-3, 0.0, 0.14), 1e-5), (), lambda plot: None)
    time = Outcome("time", TimeResult("sway", ()), (), lambda plot: None)
    for outcome in (tool, time, calibrate_stereo(board, BOARD_AT_REST)):
        keep(outcome, described.calibration, described.name, {}, accepted=True, now=NOW)
    found = calibrations_in_force(described, SERIALS, NOW)
    applied = found.apply(described)
    assert applied.frames.T_tool_gripper.position_m == (1e-3, 0.0, 0.0)
    assert applied.frames.T_tool_gripper.quaternion_wxyz == FRAMES.T_tool_gripper.quaternion_wxyz
    assert applied.stereo_calibration.name == "stereo_2026-05-04_120000.toml"
    (tmp_path / "copies").mkdir()
    names = {path.name for path in found.copy_to(tmp_path / "copies")}
    assert {"tool_2026-05-04_120000.toml", "stereo_2026-05-04_120000.toml"} < names
    assert (tmp_path / "copies" / "tool_2026-05-04_120000.png").is_file()


def test_what_a_figure_forbids_cannot_be_accepted(tmp_path: Path) -> None:
    poor = forced(0.36, std_kg=0.01)
    with pytest.raises(CalibrationError, match=r"mass, standard deviation: 0\.01 kg \(at most 0\.005\)"):
        keep(poor, tmp_path, "virtual rig", {}, accepted=True, now=NOW)
    assert read_record(keep(poor, tmp_path, "virtual rig", {}, accepted=False, now=NOW)).verdict == "rejected"


def test_a_damaged_calibration_file_is_told_with_its_line(tmp_path: Path) -> None:
    path = keep(forced(0.36), tmp_path, "virtual rig", {}, accepted=True, now=NOW)
    path.write_text(path.read_text().replace("mass_kg = 0.36", 'mass_kg = "heavy"'))
    with pytest.raises(RigError, match=r"line \d+: result\.mass_kg must be of type float"):
        read_record(path)
