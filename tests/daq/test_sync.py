import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_session import MOVE_S, WINDOW_S, SyntheticSession

from daq.errors import SynchronisationError
from daq.export import export_experiment
from daq.frames import pose
from daq.progress import silent
from daq.recording.folder import seal_session
from daq.recording.reader import Recording
from daq.synchronisation.experiment_rows import Synchronised, synchronise
from daq.synchronisation.stereo_images import StereoImages
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from estimator.experiment import read_experiment
from robot_drivers.protocols import Pose

PHANTOM = SpringPhantom(GRASP_CENTRE, placed_beads(3))


def twisted(way_m: float, angle_deg: float) -> Pose:
    turn = Rotation.from_rotvec([math.radians(angle_deg), 0.0, 0.0])
    return pose((0.04 + way_m, 0.0, 0.0), turn)


POSES = (twisted(0.0, 0.0), twisted(0.003, 20.0), twisted(0.006, 45.0))
SESSION = SyntheticSession(POSES, PHANTOM)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return SESSION.write(tmp_path_factory.mktemp("synthetic") / "session")


@pytest.fixture(scope="module")
def synchronised(folder: Path) -> Synchronised:
    return synchronise(Recording(folder), silent)


def test_every_measuring_window_becomes_a_row(synchronised: Synchronised) -> None:
    experiment = synchronised.experiment
    np.testing.assert_allclose(experiment.time, np.arange(3) * (WINDOW_S + MOVE_S), atol=1e-9)
    assert experiment.step.tolist() == [0, 1, 2]
    assert experiment.phase == ("hold",) * 3
    assert experiment.trajectory_kind == "twist_and_pull"


def test_the_wrench_is_the_tissues_on_the_gripper_without_offset_and_weight(
    synchronised: Synchronised,
) -> None:
    expected = np.array([PHANTOM.solve(pose).wrench for pose in POSES])
    error = synchronised.experiment.wrench - expected
    np.testing.assert_allclose(synchronised.experiment.wrench[0], np.zeros(6), atol=1e-12)
    assert np.abs(error[:, :3]).max() < 2e-3  # N; white noise of 13 mN over a thousand samples leaves 0.4 mN
    assert np.abs(error[:, 3:]).max() < 2e-4


def test_pulling_gives_a_force_against_the_motion(synchronised: Synchronised) -> None:
    assert synchronised.experiment.wrench[2, 0] == pytest.approx(-110.0 * 0.006, rel=0.01)


def test_the_gripper_is_where_the_robot_took_it(synchronised: Synchronised) -> None:
    experiment = synchronised.experiment
    np.testing.assert_allclose(experiment.position, [pose.position for pose in POSES], atol=1e-6)
    np.testing.assert_allclose(
        experiment.quaternion_wxyz, [pose.quaternion_wxyz for pose in POSES], atol=1e-6
    )


def test_the_beads_are_found_in_the_order_of_the_design(synchronised: Synchronised) -> None:
    expected = np.array([PHANTOM.solve(pose).beads for pose in POSES])
    error = synchronised.experiment.fiducials - expected
    assert np.sqrt(np.mean(error[..., :2] ** 2)) < 1e-5
    assert np.abs(error).max() < 1e-4
    np.testing.assert_array_equal(
        synchronised.experiment.fiducials_rest, synchronised.experiment.fiducials[0]
    )


def test_the_stated_noise_is_the_scatter_of_the_means(synchronised: Synchronised) -> None:
    sensor = synchronised.experiment.sensor
    white = math.sqrt(np.mean(SESSION.noise[:3] ** 2) / 1000)
    assert 0.5 * white < sensor.force_std < 2 * white
    assert sensor.position_std == pytest.approx(3e-5, rel=0.05)  # what the rig file states dominates
    assert 1e-7 < sensor.fiducial_std < 5e-5


def test_the_streams_are_put_on_one_clock(synchronised: Synchronised) -> None:
    assert synchronised.times["force sensor"].period_s == pytest.approx(1e-3, rel=1e-3)
    assert synchronised.times["robot"].period_s == pytest.approx(0.004032, rel=1e-3)
    assert set(synchronised.times) == {"force sensor", "robot", "camera left", "camera right"}
    assert all(len(times.gap_ends) == 0 for times in synchronised.times.values())


def test_an_image_whose_partner_was_lost_is_counted_for_its_camera(tmp_path: Path) -> None:
    session = replace(SESSION, poses=POSES[:1], right_lost=(1,))
    recording = Recording(session.write(tmp_path / "session"))
    images = StereoImages(recording, session.rig(recording.folder / "calibration" / "stereo.toml"))
    assert images.unpaired == {"camera left": 1, "camera right": 0}
    told = synchronise(recording, silent).rejected
    assert told["pairing: camera left, no partner in time"] == 1


def test_a_window_without_force_gives_an_empty_field_and_no_invented_one(tmp_path: Path) -> None:
    begin = WINDOW_S + MOVE_S
    session = replace(SESSION, lost=(begin + 0.1, begin + 0.9))
    experiment = synchronise(Recording(session.write(tmp_path / "s")), silent).experiment
    assert np.isnan(experiment.wrench[1]).all()
    assert np.isfinite(experiment.wrench[[0, 2]]).all()
    assert np.isfinite(experiment.position).all()
    assert np.isfinite(experiment.fiducials).all()


def test_without_a_rest_window_nothing_can_be_zeroed(tmp_path: Path) -> None:
    session = replace(SESSION, lost=(0.0, 0.9), frame_rate=0.1)
    with pytest.raises(SynchronisationError, match=r"force sensor has .* in the window at rest"):
        synchronise(Recording(session.write(tmp_path / "s")), silent)


def test_an_exported_experiment_is_read_back_and_tells_where_it_comes_from(
    folder: Path, tmp_path: Path
) -> None:
    seal_session(folder)
    written, provenance = export_experiment(folder, tmp_path / "experiment", silent)
    read = read_experiment(tmp_path / "experiment")
    np.testing.assert_allclose(read.wrench, written.wrench, atol=1e-5)
    told = tomllib.loads((tmp_path / "experiment" / "experiment.toml").read_text())["provenance"]
    assert told["session"] == "session"
    assert told["state"] == "sealed"
    assert [stream["name"] for stream in told["streams"]] == [stream.name for stream in provenance.streams]
    assert told["streams"][0]["rows"] == list(provenance.streams[0].rows)
    assert all(abs(count - 1000) <= 1 for count in provenance.streams[0].rows)
