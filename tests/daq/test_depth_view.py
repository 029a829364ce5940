"""One depth camera: beads in space from an image and its depth, from the wire to the exported experiment."""

import multiprocessing
import shutil
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from gige_cameras import need_aravis
from hypothesis import given
from hypothesis import strategies as st
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from synthetic_session import rendered_scene

from daq.acquisition.client import Acquisition
from daq.calibration_files.in_force import InForce
from daq.cli import main
from daq.device_checks.camera import check_camera
from daq.devices import connected
from daq.errors import RecordingError, RigError
from daq.export import export_experiment
from daq.progress import silent
from daq.recording.reader import Recording
from daq.recording.recorded_depth import RecordedDepth
from daq.recording.recovery import recover_session
from daq.recording.stored_streams import Event, Images
from daq.replay import replayed
from daq.rig import Rig, make_devices, read_rig, write_rig
from daq.session.folder import make_folder
from daq.session.session import Label
from daq.synchronisation.experiment_rows import synchronise
from daq.synchronisation.running import RunningSynchronisation
from daq.trajectories import PULL, Dwell
from daq.uncertainties import planned_noise
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.layout import (
    DEPTH_RANGE_M,
    DEPTH_STD_M,
    GRASP_CENTRE,
    SPECIMEN,
    Addresses,
    placed_beads,
    rig_description,
)
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.processes import VirtualRigSettings
from daq.virtual_rig.rendering.depth_scene import DepthScene, DepthSettings, depth_above
from daq.vision.camera_model import PinholeCamera, pose_looking_at
from daq.vision.depth import DepthTracker, DepthView, at_depth, depths_at, per_depth
from daq.vision.fiducials import FiducialSettings
from daq.vision.planar import PlanarView
from estimator.experiment import Experiment, read_experiment
from robot_drivers.cameras.depth import depth_m
from robot_drivers.protocols import DepthScale, FloatArray, Pose

ABOVE = depth_above()
ASIDE = replace(ABOVE, T_cam_tissue=pose_looking_at((-0.2, 0.05, 0.34), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
REST = np.asarray(SPECIMEN.fiducials_m)
SCALE = DepthScale(2e-5, 0.0, 0)
PHANTOM = SpringPhantom(GRASP_CENTRE, placed_beads(1))
SHORT = replace(PULL, steps=2, return_steps=1, dwell=Dwell(rest_s=1.0, settle_s=0.3, measure_s=1.0))


def written_view(folder: Path, camera: PinholeCamera = ABOVE, **wanted: float) -> DepthView:
    camera.save(folder / "camera.toml")
    return DepthView(folder / "camera.toml", **{"depth_std_m": 3e-5, "at_range_m": 0.4, **wanted})


# ---- geometry


@given(
    st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(0.1, 0.6)),
    st.lists(
        st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(-0.01, 0.02)),
        min_size=1,
        max_size=8,
    ),
)
def test_pixel_and_depth_are_carried_back_to_the_point(
    position: tuple[float, float, float], points: list[tuple[float, float, float]]
) -> None:
    camera = replace(ABOVE, T_cam_tissue=pose_looking_at(position, (0.0, 0.0, 0.0), (0.0, 1.0, 0.1)))
    places = np.array(points)
    depth, pixels = camera.to_camera(places)[:, 2], camera.project(places)
    np.testing.assert_allclose(at_depth(camera, pixels, depth), places, atol=1e-9)
    farther = at_depth(camera, pixels, depth + 1e-3)
    np.testing.assert_allclose(farther - places, 1e-3 * per_depth(camera, places), atol=1e-9)


@given(st.lists(st.booleans(), min_size=81, max_size=81), st.integers(0, 2**32 - 1))
def test_depth_at_a_bead_is_that_of_the_pixels_that_know_theirs(known: list[bool], seed: int) -> None:
    values = np.random.default_rng(seed).uniform(0.3, 0.5, (9, 9))
    depth = np.where(np.reshape(known, (9, 9)), values, np.nan)
    disc = [
        depth[row, column] for row in range(9) for column in range(9) if np.hypot(row - 4, column - 4) <= 3
    ]
    usable = sorted(value for value in disc if np.isfinite(value))
    found = depths_at(depth, np.array([[4.0, 4.0]]), np.array([3.0]), least_pixels=9)
    if len(usable) < 9:
        assert np.isnan(found.depth[0])
    else:
        quarter = len(usable) // 4
        assert found.depth[0] == pytest.approx(np.mean(usable[quarter : len(usable) - quarter]))


def test_a_few_pixels_that_are_far_off_change_little() -> None:
    depth = np.full((40, 60), 0.4) + np.random.default_rng(0).normal(0.0, 1e-4, (40, 60))
    depth[18:20, 28:32] = 1.2
    found = depths_at(depth, np.array([[30.3, 19.6]]), np.array([4.0]), least_pixels=9)
    assert abs(found.depth[0] - 0.4) < 1e-4
    assert 5e-6 < found.std[0] < 5e-5


def test_depth_is_told_finer_than_it_is_counted() -> None:
    noise = np.random.default_rng(0).normal(0.0, 1e-4, (40, 60))
    for truth in (0.4, 0.40003, 0.40005, 0.40008):
        counted = np.rint((truth + noise) / 1e-4) * 1e-4
        found = depths_at(counted, np.array([[30.0, 20.0]]), np.array([8.0]), least_pixels=9)
        assert abs(found.depth[0] - truth) < 2.5e-5


def test_a_bead_at_the_edge_of_the_image_has_the_pixels_that_there_are() -> None:
    found = depths_at(np.full((20, 20), 0.4), np.array([[0.0, 19.0], [40.0, 40.0]]), np.array([4.0, 4.0]), 9)
    assert found.depth[0] == 0.4
    assert np.isnan(found.depth[1])


# ---- beads


class Looking:
    """A camera that looks at beads, and its tracker."""

    def __init__(self, folder: Path, camera: PinholeCamera, settings: DepthSettings) -> None:
        self._scene = rendered_scene(camera, 0)
        self._depth = DepthScene(camera, SPECIMEN.phantom.size_m, SCALE, settings, seed=4)
        self.tracker = DepthTracker(written_view(folder, camera), REST, FiducialSettings())

    def images(self, beads: FloatArray, exposure: int) -> tuple[np.ndarray, FloatArray]:
        image = self._scene.render(beads, exposure)
        return image, depth_m(self._depth.render(beads, exposure), SCALE)


@pytest.mark.parametrize("camera", [ABOVE, ASIDE], ids=["from above", "aslant"])
def test_beads_are_where_they_are_by_as_much_as_is_stated(tmp_path: Path, camera: PinholeCamera) -> None:
    looking = Looking(tmp_path, camera, DepthSettings())
    distances = []
    for number in range(4):
        truth = np.add(REST, [1e-3 * number, 0.0, -2e-4 * number])
        found = looking.tracker.update(*looking.images(truth, number), 0.2 * number)
        error = found.positions - truth
        assert np.isfinite(error).all()
        assert np.abs(error).max() < 2e-4
        distances.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covariances), error))
    # three degrees of freedom; the error that stays is the same in all images
    assert 1.5 < np.mean(distances) < 6.0


def test_the_deviation_is_large_along_the_axis_and_small_across_it(tmp_path: Path) -> None:
    looking = Looking(tmp_path, ASIDE, DepthSettings())
    found = looking.tracker.update(*looking.images(REST, 0), 0.0)
    in_camera = ASIDE.R_cam_tissue @ found.covariances @ ASIDE.R_cam_tissue.T
    across, along = np.sqrt(in_camera[:, 0, 0]), np.sqrt(in_camera[:, 2, 2])
    assert (along > 2 * across).all()
    assert (along > 3e-5 * 0.9).all()


def test_a_bead_without_depth_is_not_seen(tmp_path: Path) -> None:
    looking = Looking(tmp_path, ABOVE, DepthSettings())
    image, depth = looking.images(REST, 0)
    column, row = np.rint(ABOVE.project(REST[5])).astype(int)
    depth[row - 6 : row + 7, column - 6 : column + 7] = np.nan
    found = looking.tracker.update(image, depth, 0.0)
    assert np.flatnonzero(np.isnan(found.positions).any(axis=1)).tolist() == [5]
    assert found.rejected["depth: no depth"] == 1


def test_the_noise_of_each_axis_is_that_of_its_share_of_the_depth(tmp_path: Path) -> None:
    at_axis = written_view(tmp_path).noise_by_axis([(0.0, 0.0, 0.0)], 1e-6)
    assert at_axis["z"] == pytest.approx(3e-5, rel=0.01)
    assert at_axis["x"] < 2e-6
    twice_as_far = replace(ABOVE, T_cam_tissue=pose_looking_at((0, 0, 0.8), (0, 0, 0), (1, 0, 0)))
    assert written_view(tmp_path, twice_as_far).noise_by_axis([(0.0, 0.0, 0.0)], 0.0)["z"] == pytest.approx(
        4 * 3e-5, rel=0.01
    )
    told = written_view(tmp_path, ABOVE, depth_std_m=0.0).noise_by_axis(REST, (1e-6, 2e-6, 3e-6))
    assert told == pytest.approx({"x": 1e-6, "y": 2e-6, "z": 3e-6})


# ---- the rig file


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    ABOVE.save(tmp_path / "camera.toml")
    return rig_description(Addresses(1, 2, 3, 4, 5, 6, (), "127.0.0.9"), tmp_path / "camera.toml")


def test_a_rig_file_keeps_its_depth_view(rig: Rig, tmp_path: Path) -> None:
    write_rig(rig, tmp_path / "rig.toml")
    read = read_rig(tmp_path / "rig.toml")
    assert read == rig
    assert read.depth_view == DepthView(tmp_path / "camera.toml", DEPTH_STD_M, DEPTH_RANGE_M)
    assert read.with_depth == {"above"}
    assert [camera.name for camera in read.measuring_cameras] == ["above"]


def test_what_does_not_go_with_a_depth_view_is_refused(rig: Rig, tmp_path: Path) -> None:
    planar = PlanarView(tmp_path / "camera.toml", 0.0)
    second = replace(rig.cameras[0], name="second")
    plain = replace(rig.cameras[0], settings=replace(rig.cameras[0].settings, depth=False))  # type: ignore[type-var]
    for wrong, words in (
        (replace(rig, planar_view=planar), "planar_view is of a camera without depth"),
        (replace(rig, cameras=(*rig.cameras, second)), "depth_view is of one camera, and the rig has 2"),
        (replace(rig, cameras=(plain,)), "depth_view is of a camera that sends depth, and 'above'"),
    ):
        write_rig(wrong, tmp_path / "rig.toml")
        with pytest.raises(RigError, match=words) as refused:
            read_rig(tmp_path / "rig.toml")
        assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("key", "value"), [("depth_std_m", -1e-5), ("at_range_m", 0.0), ("at_range_m", -0.4), ("least_pixels", 0)]
)
def test_a_view_that_cannot_be_is_refused(key: str, value: float) -> None:
    with pytest.raises(ValueError, match=key):
        DepthView(Path("camera.toml"), **{"depth_std_m": 3e-5, "at_range_m": 0.4, key: value})  # type: ignore[arg-type]


def test_a_session_keeps_a_copy_of_the_calibration(rig: Rig, tmp_path: Path) -> None:
    make_folder(tmp_path / "session", rig, InForce({}, {}, ()))
    kept = read_rig(tmp_path / "session" / "rig.toml").depth_view
    assert kept is not None
    assert kept.calibration == tmp_path / "session" / "calibration" / "camera.toml"
    assert kept.camera() == ABOVE


def test_a_plan_counts_with_the_deviation_of_the_depth(rig: Rig) -> None:
    std = planned_noise(rig, 1.0).sensor.bead_std
    assert std[2] > 3 * max(std[0], std[1])


# ---- what the counts mean


@dataclass
class Told:
    """What a recording tells of the scales of its depth."""

    events: Sequence[Event]

    def depth(self, camera: str) -> Images:
        none = np.empty(0, np.int64)
        return Images(none, np.empty(0), none, none, [])


def told_scale(camera: str, scale_m: float) -> Event:
    return Event(0, "depth_scale", {"camera": camera, "scale_m": scale_m, "offset_m": 0.0, "invalid": None})


def test_the_scale_is_that_of_the_camera() -> None:
    told = Told([told_scale("other", 1e-3), told_scale("above", 1e-4), told_scale("above", 1e-4)])
    assert RecordedDepth.of(told, "above").scale == DepthScale(1e-4, 0.0, None)
    assert RecordedDepth.of(told, "third").scale is None


def test_a_scale_that_changed_is_told() -> None:
    with pytest.raises(RecordingError, match="'above' was counted in 2 scales"):
        RecordedDepth.of(Told([told_scale("above", 1e-4), told_scale("above", 2e-4)]), "above")


@pytest.mark.parametrize("spoiled", [{"scale_m": "wide"}, {"offset_m": None}, {"invalid": "no"}])
def test_an_event_that_tells_no_scale_is_refused(spoiled: dict[str, object]) -> None:
    event = told_scale("above", 1e-4)
    told = Told([replace(event, details={**event.details, **spoiled})])
    with pytest.raises(RecordingError, match="tells no scale"):
        RecordedDepth.of(told, "above")


# ---- the whole way


@dataclass(frozen=True)
class Recorded:
    """A session of the emulated laboratory with a depth camera, and its experiment."""

    rig: Rig
    session: Path
    experiment: Experiment


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recorded]:
    need_aravis()
    folder = tmp_path_factory.mktemp("laboratory")
    others = multiprocessing.active_children()
    settings = VirtualRigSettings(PHANTOM, seed=1, frames_per_s=4.0, cameras=1, depth=True)
    with virtual_rig(folder, settings) as running:
        rig = read_rig(running.rig_path)
        with connected(make_devices(rig)) as devices:
            told = check_camera(devices.cameras["above"], None, (ABOVE.width, ABOVE.height), 2.0)
            assert [check.name for check in told if not check.passed] == []
            assert "known in 98 % of the pixels" in told[-1].told
        with Acquisition(rig) as acquisition:
            acquisition.record(SHORT.trajectory(), folder / "session", Label("pull"), silent)
        experiment, _ = export_experiment(folder / "session", folder / "experiment", silent)
        yield Recorded(rig, folder / "session", experiment)
    assert set(multiprocessing.active_children()) <= set(others)


def test_depth_is_recorded_beside_each_image(recorded: Recorded) -> None:
    recording = Recording(recorded.session)
    images, found = recording.images("above"), RecordedDepth.of(recording, "above")
    assert recording.info.problems == ()
    assert recording.cameras == ("above",)
    np.testing.assert_array_equal(images.host_time_ns, found.images.host_time_ns)
    np.testing.assert_array_equal(images.counter, found.images.counter)
    assert found.scale == DepthScale(pytest.approx(2e-5), 0.0, 0)
    depth = found.metres(0)
    assert depth.shape == (ABOVE.height, ABOVE.width)
    assert np.nanmedian(depth) == pytest.approx(0.4 - 0.005, abs=2e-4)
    assert np.isnan(depth).mean() == pytest.approx(0.02, abs=0.005)


def test_the_beads_are_found_in_space_by_as_much_as_is_stated(recorded: Recorded) -> None:
    experiment = recorded.experiment
    expected = np.array([PHANTOM.solve(Pose(tuple(position))).beads for position in experiment.position])
    error = experiment.fiducials - expected
    assert np.isfinite(error).all()
    rms = np.sqrt(np.mean(error**2, axis=(0, 1)))
    assert (rms < 2 * experiment.sensor.bead_std).all()
    assert (rms[:2] < 2e-5).all()
    assert 0.3 * experiment.sensor.bead_std[2] < rms[2]


def test_the_exported_folder_holds_three_dimensions_and_their_noise(recorded: Recorded) -> None:
    read = read_experiment(recorded.session.with_name("experiment"))
    np.testing.assert_allclose(read.fiducials, recorded.experiment.fiducials)
    assert set(read.sensor.by_channel) == {"x", "y", "z"}
    assert read.sensor.bead_std[2] > 2 * read.sensor.bead_std[:2].max()


def test_a_recording_that_still_runs_gives_the_same_rows(recorded: Recorded) -> None:
    running, found = RunningSynchronisation(recorded.session), None
    while (more := running.read_rest()) is not None:
        found = more
    assert found is not None
    whole = synchronise(Recording(recorded.session), silent).experiment
    # it looks at fewer images, whose depth scatters more
    apart = np.abs(found.experiment.fiducials - whole.fiducials).max(axis=(0, 1))
    assert (apart < [5e-6, 5e-6, 3e-5]).all()


def test_a_damaged_recording_keeps_the_depth_that_is_whole(recorded: Recorded, tmp_path: Path) -> None:
    session = tmp_path / "session"
    shutil.copytree(recorded.session, session)
    file = session / "cameras.mcap"
    content = bytearray(file.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 200] = bytes(200)
    file.write_bytes(content)
    found = recover_session(session)
    before, after = (RecordedDepth.of(Recording(folder), "above") for folder in (recorded.session, session))
    lost = found.lost["camera/above/depth"].samples if "camera/above/depth" in found.lost else 0
    assert 0 < len(after.images) == len(before.images) - lost
    assert sum(loss.samples for loss in found.lost.values()) > 0
    kept = dict(zip(before.images.counter.tolist(), range(len(before.images)), strict=True))
    for number, counter in enumerate(after.images.counter.tolist()):
        np.testing.assert_array_equal(after.images.depth(number), before.images.depth(kept[counter]))


def test_a_reader_of_ros_2_finds_depth_in_metres(recorded: Recorded, tmp_path: Path) -> None:
    assert main(["export", str(recorded.session), "--format", "ros2", "--output", str(tmp_path / "bag")]) == 0
    expected = RecordedDepth.of(Recording(recorded.session), "above")
    with AnyReader([tmp_path / "bag"], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        wanted = [one for one in reader.connections if one.topic == "/camera/above/depth/image_raw"]
        found = [reader.deserialize(raw, one.msgtype) for one, _, raw in reader.messages(wanted)]
    assert len(found) == len(expected.images)
    for number, image in enumerate(found[:3]):
        assert (image.encoding, image.header.frame_id) == ("32FC1", "camera_above")
        metres = np.frombuffer(image.data, "<f4").reshape(image.height, image.width)
        np.testing.assert_array_equal(metres, expected.metres(number).astype(np.float32))


def test_a_replay_brings_each_image_with_its_depth(recorded: Recorded) -> None:
    recording = Recording(recorded.session)
    devices, _ = replayed(recording, speed=100.0)
    camera, frames = devices.cameras["above"], []
    end = time.monotonic() + 60.0
    while len(frames) < 5 and time.monotonic() < end:
        frames += camera.read(0.1)
    for number, frame in enumerate(frames[:5]):
        assert frame.depth is not None
        np.testing.assert_array_equal(frame.depth.counts, recording.depth("above").depth(number))
        assert frame.depth.scale.scale_m == pytest.approx(2e-5)
