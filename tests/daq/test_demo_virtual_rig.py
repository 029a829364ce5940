import math
import multiprocessing
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from daq.devices import connected
from daq.errors import SoftwareStopError
from daq.export import export_experiment
from daq.frames import pose
from daq.progress import silent
from daq.recording.folder import read_info
from daq.recording.reader import Recording
from daq.rig import Rig, make_devices, read_rig
from daq.session.session import Label, run_session
from daq.trajectories import PULL, Dwell
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.layout import GRASP_CENTRE, REST_TOOL, SPECIMEN, placed_beads
from daq.virtual_rig.physics.fem_phantom import FemPhantom
from daq.virtual_rig.physics.phantom import PhantomMotion, PhantomState, SpringPhantom
from daq.virtual_rig.processes import VirtualRigSettings
from estimator.experiment import Experiment
from estimator.fem.discretisation.block_mesh import Grading
from robot_drivers.protocols import Pose

PHANTOM = SpringPhantom(GRASP_CENTRE, placed_beads(1))
COARSE = Grading(grasp_m=3e-3, anchor_m=6e-3, largest_m=20e-3, growth=2.0, layers=1)
SHORT = replace(PULL, steps=2, return_steps=1, dwell=Dwell(rest_s=1.0, settle_s=0.3, measure_s=1.0))


@dataclass(frozen=True)
class Laboratory:
    """A running virtual rig, one finished session in it, and the experiment of that session."""

    rig: Rig
    session: Path
    experiment: Experiment


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    folder = tmp_path_factory.mktemp("laboratory")
    others = multiprocessing.active_children()
    with virtual_rig(folder, VirtualRigSettings(PHANTOM, seed=1, frames_per_s=4.0)) as running:
        rig = read_rig(running.rig_path)
        with connected(make_devices(rig)) as devices:
            run_session(rig, devices, SHORT.trajectory(), folder / "session", Label("pull"), silent)
        experiment, _ = export_experiment(folder / "session", folder / "experiment", silent)
        yield Laboratory(rig, folder / "session", experiment)
    assert set(multiprocessing.active_children()) <= set(others)


def test_real_drivers_record_the_emulated_devices_without_a_loss(laboratory: Laboratory) -> None:
    info = read_info(laboratory.session)
    assert info.state == "sealed"
    recording = Recording(laboratory.session)
    assert np.diff(recording.force.counter).min() >= 1
    assert recording.force.usable.all()
    assert len(recording.force) > 0.9 * 1000 * laboratory.experiment.time[-1]
    assert recording.images("left").pixel_format(0) == "mono8"


def test_devices_tell_who_they_are(laboratory: Laboratory) -> None:
    devices = read_info(laboratory.session).devices
    assert devices["force sensor"].serial == "FT33206"
    assert devices["robot"].details["pose_source"].startswith("EGM")
    assert {"camera left", "camera right"} < set(devices)


def test_the_springs_are_found_in_the_exported_wrench(laboratory: Laboratory) -> None:
    experiment = laboratory.experiment
    expected = np.array([PHANTOM.solve(Pose(tuple(position))).wrench for position in experiment.position])
    error = experiment.wrench - expected
    assert np.abs(error[:, :3]).max() < 5e-3
    assert np.abs(error[:, 3:]).max() < 5e-4
    np.testing.assert_allclose(experiment.position[:, 0] - 0.04, [0.0, 0.002, 0.004, 0.0], atol=1e-4)


def test_the_beads_are_found_where_they_were_placed(laboratory: Laboratory) -> None:
    experiment = laboratory.experiment
    expected = np.array([PHANTOM.solve(Pose(tuple(position))).beads for position in experiment.position])
    error = experiment.fiducials - expected
    assert np.sqrt(np.nanmean(error**2)) < 3e-5
    assert np.isfinite(error).all()


def test_a_force_limit_stops_the_emulated_robot_on_its_way(laboratory: Laboratory, tmp_path: Path) -> None:
    tight = replace(laboratory.rig, limits=replace(laboratory.rig.limits, force_n=0.3))
    with connected(make_devices(laboratory.rig)) as devices:
        with pytest.raises(SoftwareStopError, match=r"force of .* N exceeds the limit of 0\.3 N"):
            run_session(tight, devices, SHORT.trajectory(), tmp_path / "s", Label("pull"), silent)
        state = devices.robot.state()
        assert state.stopped
        assert not state.moving
        devices.robot.resume()
        devices.robot.move_linear(REST_TOOL, SHORT.speed, 5.0)
    stop = next(event for event in Recording(tmp_path / "s").events if event.name == "session_failed")
    assert stop.details["guard"]["reaction_s"] >= 0.0
    assert read_info(tmp_path / "s").state == "sealed"


def near_rest(way_m: float, angle_deg: float) -> Pose:
    return pose((0.04 + way_m, 0.0, 0.0), Rotation.from_rotvec([0.0, 0.0, math.radians(angle_deg)]))


def cubic_state(at: Pose) -> PhantomState:
    """A phantom whose force is a cubic of the way along x, and linear in the turn."""
    x = at.position[0] - 0.04
    turn = Rotation.from_quat(at.quaternion_wxyz, scalar_first=True).as_rotvec()[2]
    wrench = np.array([-100 * x + 4e3 * x**2 - 5e5 * x**3, 0, 0, 0, 0, -0.05 * turn])
    by_pose = np.zeros((6, 6))
    by_pose[0, 0] = -100 + 8e3 * x - 1.5e6 * x**2
    by_pose[5, 5] = -0.05
    return PhantomState(at, wrench, np.zeros((1, 3)), by_pose, np.zeros((1, 3, 6)))


def test_between_two_solutions_the_phantom_is_continued_as_a_cubic() -> None:
    motion = PhantomMotion(cubic_state(near_rest(0.001, 0.0)), cubic_state(near_rest(0.002, 0.0)))
    for way_m in (0.0, 0.0015, 0.002, 0.004):
        at = near_rest(way_m, 3.0)
        np.testing.assert_allclose(motion.wrench(at), cubic_state(at).wrench, atol=1e-12)


def test_a_single_solution_is_continued_linearly() -> None:
    state = cubic_state(near_rest(0.001, 0.0))
    wrench = PhantomMotion(state, state).wrench(near_rest(0.002, 0.0))
    assert wrench[0] == pytest.approx(state.wrench[0] + 1e-3 * state.wrench_by_pose[0, 0])


@pytest.mark.parametrize("angle_deg", [0.0, 4.5], ids=["pull", "turn"])
def test_continuing_the_elastic_phantom_by_a_step_is_as_good_as_solving_it(angle_deg: float) -> None:
    solver = FemPhantom(SPECIMEN, placed_beads(0), 15e3, 0.45, COARSE).build()
    before, newest, there = (
        solver.solve(near_rest(share * 0.003, share * angle_deg)) for share in (0.0, 1 / 3, 1.0)
    )
    motion = PhantomMotion(before, newest)
    np.testing.assert_allclose(motion.wrench(there.T_tissue_gripper)[:3], there.wrench[:3], atol=1e-4)
    np.testing.assert_allclose(motion.beads(there.T_tissue_gripper), there.beads, atol=1e-6)
