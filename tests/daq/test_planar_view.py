"""One calibrated camera: beads of a flat face in two dimensions, from its calibration to the experiment."""

import json
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from synthetic_session import SyntheticSession, rendered_scene

from daq.calibration.collected_views import ONLY, BoardViews
from daq.calibration.of_rig import kinds_of, why_not
from daq.calibration.one_camera import calibrate_camera
from daq.calibration_files.in_force import InForce, calibrations_in_force
from daq.calibration_files.outcome import KINDS
from daq.cli import main
from daq.errors import CalibrationError, RigError
from daq.export import export_experiment
from daq.frames import pose
from daq.progress import silent
from daq.recording.folder import seal_session
from daq.recording.reader import Recording
from daq.rig import Rig, read_rig, write_rig
from daq.session.folder import make_folder
from daq.synchronisation.alignment import check_alignment
from daq.synchronisation.experiment_rows import Synchronised, synchronise
from daq.synchronisation.running import RunningSynchronisation
from daq.virtual_rig.layout import GRASP_CENTRE, SPECIMEN, placed_beads
from daq.virtual_rig.operator import BOARD, BOARD_AT_REST, board_pose
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.rendering.board_scene import BoardScene
from daq.virtual_rig.rendering.scene import flea2_pair
from daq.vision.camera_model import PinholeCamera, pose_looking_at
from daq.vision.errors import VisionError
from daq.vision.fiducials import FiducialSettings
from daq.vision.planar import PlanarTracker, PlanarView, at_height, height_slopes
from estimator.experiment import read_experiment

CAMERA = flea2_pair().left
REST = np.asarray(SPECIMEN.fiducials_m)
HEIGHT_STD_M = 2e-4
PHANTOM = SpringPhantom(GRASP_CENTRE, placed_beads(3))
POSES = tuple(pose((0.04 + way, 0.0, 0.0), Rotation.identity()) for way in (0.0, 0.003, 0.006))
SESSION = SyntheticSession(POSES, PHANTOM)


def seen_at_design_height(beads):
    """Where a camera that takes each bead for as high as its design sees it, (n, 2), m."""
    return at_height(CAMERA, CAMERA.project(beads), REST[:, 2])[:, :2]


# ---- geometry


@given(
    st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(0.1, 0.6)),
    st.lists(
        st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(-0.01, 0.02)),
        min_size=1,
        max_size=8,
    ),
)
def test_a_pixel_is_carried_back_to_the_point_at_its_height(position, points) -> None:
    camera = replace(CAMERA, T_cam_tissue=pose_looking_at(position, (0.0, 0.0, 0.0), (0.0, 1.0, 0.1)))
    places = np.array(points)
    found = at_height(camera, camera.project(places), places[:, 2])
    usable = np.isfinite(found).all(axis=1)
    np.testing.assert_allclose(found[usable], places[usable], atol=1e-8)
    slopes = np.linalg.norm(height_slopes(camera, places), axis=1)
    assert (usable | (slopes > 1.9)).all()


def test_a_height_that_is_off_moves_what_is_seen_by_the_slope_of_the_ray() -> None:
    off_m = 1e-5
    raised = np.add(REST, [0.0, 0.0, off_m])
    moved = seen_at_design_height(raised) - REST[:, :2]
    np.testing.assert_allclose(moved, height_slopes(CAMERA, REST) * off_m, rtol=1e-3, atol=1e-12)


def test_a_ray_along_the_face_meets_it_nowhere() -> None:
    level = replace(
        CAMERA, T_cam_tissue=pose_looking_at((0.3, 0.0, 0.005), (0.0, 0.0, 0.005), (0.0, 0.0, 1.0))
    )
    middle = np.array([level.principal_point])
    assert np.isnan(at_height(level, middle, 0.005)).all()


# ---- beads


def test_beads_are_true_in_two_dimensions_and_without_a_height() -> None:
    tracker = PlanarTracker(CAMERA, REST, FiducialSettings())
    scene = rendered_scene(CAMERA, 0)
    for number, way in enumerate((0.0, 0.001, 0.002)):
        truth = np.add(REST, [way, 0.0, 0.0])
        found = tracker.update(scene.render(truth, number), 0.1 * number)
        assert np.isnan(found.positions[:, 2]).all()
        assert np.abs(found.positions[:, :2] - truth[:, :2]).max() < 3e-5
        spread = np.sqrt(found.covariances[:, [0, 1], [0, 1]])
        assert (spread > 1e-7).all()
        assert (spread < 3e-5).all()


def test_beads_of_several_heights_are_refused() -> None:
    with pytest.raises(VisionError, match=r"differ by 4\.0 mm"):
        PlanarTracker(CAMERA, [*REST[:-1], REST[-1] - [0, 0, 0.004]], FiducialSettings())


def test_what_is_no_view_of_the_beads_is_refused() -> None:
    with pytest.raises(VisionError, match="first images"):
        PlanarTracker(CAMERA, REST, FiducialSettings()).update(
            np.full((CAMERA.height, CAMERA.width), 128, np.uint8), 0.0
        )


# ---- from a recording to an experiment


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session whose rig has the left camera only."""
    folder = SESSION.write(tmp_path_factory.mktemp("planar") / "session")
    calibration = folder / "calibration" / "camera.toml"
    CAMERA.save(calibration)
    rig = SESSION.rig(folder / "calibration" / "stereo.toml")
    write_rig(with_one_camera(rig, calibration), folder / "rig.toml")
    return folder


def with_one_camera(rig: Rig, calibration: Path) -> Rig:
    view = PlanarView(calibration, HEIGHT_STD_M)
    return replace(rig, cameras=rig.cameras[:1], stereo_calibration=None, planar_view=view)


@pytest.fixture(scope="module")
def synchronised(folder: Path) -> Synchronised:
    return synchronise(Recording(folder), silent)


def test_beads_become_points_in_the_plane(synchronised: Synchronised) -> None:
    experiment = synchronised.experiment
    expected = np.array([seen_at_design_height(PHANTOM.solve(pose).beads) for pose in POSES])
    assert np.isnan(experiment.fiducials[..., 2]).all()
    assert np.sqrt(np.mean((experiment.fiducials[..., :2] - expected) ** 2)) < 2e-5
    np.testing.assert_allclose(experiment.fiducials_rest[:, :2], experiment.fiducials[0, :, :2])
    np.testing.assert_allclose(experiment.fiducials_rest[:, 2], REST[:, 2])


def test_the_uncertain_height_is_in_the_noise_of_each_axis(synchronised: Synchronised) -> None:
    sensor = synchronised.experiment.sensor
    slopes = np.sqrt(np.mean(height_slopes(CAMERA, REST) ** 2, axis=0))
    for axis, slope in zip("xy", slopes, strict=True):
        assert sensor.by_channel[axis] == pytest.approx(
            np.hypot(sensor.fiducial_std, HEIGHT_STD_M * slope), rel=0.05
        )
        assert sensor.by_channel[axis] > sensor.fiducial_std


def test_the_exported_folder_holds_two_dimensions(folder: Path, tmp_path: Path) -> None:
    seal_session(folder)
    experiment, _ = export_experiment(folder, tmp_path / "exported", silent)
    read = read_experiment(tmp_path / "exported")
    np.testing.assert_allclose(read.fiducials, experiment.fiducials)
    assert np.isnan(read.fiducials[..., 2]).all()
    assert np.isfinite(read.fiducials[..., :2]).all()
    header = (tmp_path / "exported" / "observations.csv").read_text().splitlines()
    assert "m00z" in header[0]
    assert set(
        tomllib.loads((tmp_path / "exported" / "experiment.toml").read_text())["sensor"]["by_channel"]
    ) == {
        "x",
        "y",
    }


def test_a_recording_that_still_runs_gives_the_same_rows(folder: Path, synchronised: Synchronised) -> None:
    running = RunningSynchronisation(folder)
    found = None
    while (more := running.read_rest()) is not None:
        found = more
    assert found is not None
    np.testing.assert_allclose(found.experiment.fiducials, synchronised.experiment.fiducials, atol=2e-6)


def test_the_motion_of_the_beads_is_compared_with_the_robots(folder: Path) -> None:
    told = {
        one.stream: one for one in check_alignment(Recording(folder), read_rig(folder / "rig.toml"), silent)
    }
    assert "no image was taken while the robot moved" in told["cameras"].remark


# ---- the rig file


def test_a_rig_file_keeps_its_planar_view(folder: Path) -> None:
    rig = read_rig(folder / "rig.toml")
    assert rig.planar_view == PlanarView(folder / "calibration" / "camera.toml", HEIGHT_STD_M)
    assert rig.planar_view.camera() == CAMERA
    assert [camera.name for camera in rig.measuring_cameras] == ["left"]


def test_two_cameras_have_no_planar_view(folder: Path, tmp_path: Path) -> None:
    rig = SESSION.rig(folder / "calibration" / "stereo.toml")
    view = PlanarView(folder / "calibration" / "camera.toml", 0.0)
    write_rig(replace(rig, planar_view=view), tmp_path / "rig.toml")
    with pytest.raises(RigError, match="planar_view is of one camera, and the rig has 2"):
        read_rig(tmp_path / "rig.toml")


def test_a_height_that_is_less_than_certain_is_refused(folder: Path, tmp_path: Path) -> None:
    text = (folder / "rig.toml").read_text().replace("height_std_m = 0.0002", "height_std_m = -0.0002")
    (tmp_path / "rig.toml").write_text(text)
    with pytest.raises(RigError, match="height_std_m must not be negative"):
        read_rig(tmp_path / "rig.toml")


def test_a_session_keeps_a_copy_of_the_calibration(folder: Path, tmp_path: Path) -> None:
    rig = read_rig(folder / "rig.toml")
    make_folder(tmp_path / "session", rig, InForce({}, {}, ()))
    kept = read_rig(tmp_path / "session" / "rig.toml")
    assert kept.planar_view is not None
    assert kept.planar_view.calibration == tmp_path / "session" / "calibration" / "camera.toml"
    assert kept.planar_view.camera() == CAMERA


# ---- its calibration


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Images of a board that lies on the phantom first, and then is held elsewhere, tilted."""
    folder = tmp_path_factory.mktemp("views")
    scene = BoardScene(CAMERA, BOARD)
    for number in range(14):
        assert cv2.imwrite(str(folder / f"{number:04d}.png"), scene.render(board_pose(number), number))
    return folder


@pytest.fixture(scope="module")
def kept(folder: Path, views: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The calibration that was accepted from all of them."""
    output = tmp_path_factory.mktemp("kept")
    command = ["calibrate", "camera", str(folder / "rig.toml"), "--images", str(views)]
    assert main([*command, "--output", str(output)]) == 0
    (file,) = output.glob("*.toml")
    return file


def test_the_camera_is_calibrated_in_the_frame_of_the_phantom(kept: Path) -> None:
    camera = PinholeCamera.load(kept)
    assert camera.focal_length[0] == pytest.approx(CAMERA.focal_length[0], rel=3e-3)
    np.testing.assert_allclose(camera.centre, CAMERA.centre, atol=1.5e-3)
    # what counts are places on the phantom's face
    found = at_height(camera, CAMERA.project(REST), REST[:, 2])
    np.testing.assert_allclose(found, REST, atol=1e-4)


def test_without_its_first_view_nobody_knows_where_the_phantom_is(
    folder: Path, views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = tmp_path / "given"
    shutil.copytree(views, given)
    assert cv2.imwrite(str(given / "0000.png"), np.zeros((CAMERA.height, CAMERA.width), np.uint8))
    command = ["calibrate", "camera", str(folder / "rig.toml"), "--images", str(given)]
    assert main([*command, "--output", str(tmp_path / "kept"), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["verdict"] == "rejected"
    failed = [figure["name"] for figure in told["figures"] if not figure["passed"]]
    assert failed == ["views of the board at its known place"]


def test_too_few_views_are_told_with_what_to_do() -> None:
    collected = BoardViews(BOARD, ONLY)
    assert "not taken" in collected.add(np.zeros((964, 1288), np.uint8)).describe()
    with pytest.raises(CalibrationError, match="0 views were taken, 12 are needed"):
        calibrate_camera(collected, BOARD_AT_REST)


def test_a_calibration_in_force_goes_before_the_rig_files(kept: Path, folder: Path) -> None:
    rig = replace(read_rig(folder / "rig.toml"), calibration=kept.parent)
    applied = calibrations_in_force(rig, {}).apply(rig)
    assert applied.planar_view == PlanarView(kept, HEIGHT_STD_M)


def test_a_calibration_that_nothing_uses_is_told_with_what_to_write(
    kept: Path, folder: Path, views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = replace(read_rig(folder / "rig.toml"), calibration=kept.parent, planar_view=None)
    found = calibrations_in_force(rig, {})
    assert found.records == {}
    assert found.apply(rig) == rig
    (warning,) = found.warnings
    assert warning.startswith(f"{kept.name} is not in force: the rig file has no [planar_view]")
    write_rig(rig, tmp_path / "rig.toml")
    command = ["calibrate", "camera", str(tmp_path / "rig.toml"), "--images", str(views)]
    assert main([*command, "--output", str(tmp_path / "kept")]) == 0
    assert "not in force: the rig file has no [planar_view]" in capsys.readouterr().out


def test_of_two_cameras_that_of_an_only_one_is_not_in_force(kept: Path, folder: Path) -> None:
    rig = replace(SESSION.rig(folder / "calibration" / "stereo.toml"), calibration=kept.parent)
    assert calibrations_in_force(rig, {}) == InForce({}, {}, ())


# ---- which calibrations are made of a rig


@pytest.mark.parametrize(
    ("cameras", "refused"), [(1, {"cameras", "stereo", "robot"}), (2, {"camera"}), (3, {"camera"})]
)
def test_a_rig_is_calibrated_by_its_number_of_cameras(folder: Path, cameras: int, refused: set[str]) -> None:
    rig = SESSION.rig(folder / "calibration" / "stereo.toml")
    third = replace(rig.cameras[0], name="third")
    of_so_many = replace(rig, cameras=(*rig.cameras, third)[:cameras])
    assert set(KINDS) - set(kinds_of(of_so_many)) == refused
    for kind in KINDS:
        told = why_not(kind, of_so_many)
        assert bool(told) == (kind in refused)
        assert "\n" not in told


@pytest.mark.parametrize("kind", ["cameras", "stereo", "robot"])
def test_what_takes_two_cameras_is_refused_before_anything_is_connected(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str
) -> None:
    command = ["calibrate", kind, str(folder / "rig.toml"), "--output", str(tmp_path / "kept")]
    assert main(command) == 2
    assert "has one" in capsys.readouterr().err
    assert not (tmp_path / "kept").exists()
