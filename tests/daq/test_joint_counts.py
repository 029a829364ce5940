"""Robots of six and of seven joints, from the block of samples to what is exported."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_bench import Bench
from synthetic_session import SyntheticSession

from daq.blocks import joined
from daq.errors import SessionError
from daq.export import export_ros2, export_tables
from daq.progress import silent
from daq.recording.folder import seal_session
from daq.recording.messages.rows import joints_layout, pose_layout, stamp_layout
from daq.recording.reader import Recording
from daq.recording.scanning.recognition import topic_of
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from robot_drivers.protocols import JOINT_COUNTS, Pose, PoseBlock, RobotState
from robot_drivers.specification import RobotSpecification

FRAME = "robot_base"


def pose_block(samples: int, joints: int) -> PoseBlock:
    counter = np.arange(samples)
    return PoseBlock(
        counter=counter,
        device_time_s=counter * 0.008,
        host_time_ns=10**15 + counter * 8_000_000,
        position=counter[:, None] * [1e-3, 2e-3, 3e-3],
        quaternion_wxyz=np.tile([0.5, 0.5, -0.5, 0.5], (samples, 1)),
        joints=counter[:, None] + np.arange(joints) / 10,
        moving=counter % 2 == 0,
    )


@pytest.fixture(params=JOINT_COUNTS)
def joints(request: pytest.FixtureRequest) -> int:
    count: int = request.param
    return count


class Robot:
    """Tells joint angles, as many as it is made with, in state and stream."""

    def __init__(self, bench: Bench, joints: int) -> None:
        self._state, self._read, self._joints = bench.robot.state, bench.robot.read, joints

    def state(self) -> RobotState:
        return replace(self._state(), joints=(0.1,) * self._joints)

    def read(self, timeout_s: float) -> PoseBlock:
        block = self._read(timeout_s)
        return replace(block, joints=np.tile(0.1 * np.arange(self._joints), (len(block), 1)))


def bench_with(folder: Path, joints: int, monkeypatch: pytest.MonkeyPatch, stated: int) -> Bench:
    """A bench whose robot has so many joints, and whose driver says that it has ``stated``."""
    bench = Bench(folder)
    robot = Robot(bench, joints)
    bench.robot.state, bench.robot.read = robot.state, robot.read  # type: ignore[method-assign]
    monkeypatch.setattr(type(bench.rig), "robot_specification", lambda rig: RobotSpecification(joints=stated))
    return bench


def test_a_session_keeps_every_joint(tmp_path: Path, joints: int, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = bench_with(tmp_path, joints, monkeypatch, stated=joints)
    bench.run()
    recorded = Recording(bench.folder).robot.joints
    assert recorded.shape[1] == joints
    np.testing.assert_array_equal(recorded, np.tile(0.1 * np.arange(joints), (len(recorded), 1)))
    tables = export_tables(bench.folder, "csv", tmp_path / "tables", silent)
    header = (tmp_path / "tables" / "robot.csv").read_text(encoding="utf-8").splitlines()[0]
    assert f"joint_{joints} (rad)" in header
    assert f"joint_{joints + 1}" not in header
    assert tables.rows["robot"] == len(recorded)
    assert export_ros2(bench.folder, tmp_path / "bag", silent).messages["/robot/joints"] == len(recorded)


def test_joints_that_the_driver_does_not_announce_are_refused_before_anything_moves(
    tmp_path: Path, joints: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = 13 - joints
    bench = bench_with(tmp_path, joints, monkeypatch, stated=other)
    with pytest.raises(SessionError, match=f"{joints} joint angles, its driver 'irb140' says {other}"):
        bench.run()
    assert bench.robot.poses == []
    assert not bench.folder.exists()


def test_a_recording_of_six_joints_reads_as_before(tmp_path: Path) -> None:
    poses = (Pose((0.04, 0.0, 0.0)), Pose((0.043, 0.0, 0.0)))
    SyntheticSession(poses, SpringPhantom(GRASP_CENTRE, placed_beads(3))).write(tmp_path / "session")
    seal_session(tmp_path / "session")
    assert Recording(tmp_path / "session").robot.joints.shape[1] == 6


def test_a_message_without_its_declaration_is_known_by_its_size(joints: int) -> None:
    sizes = {joints_layout(FRAME, count).dtype.itemsize for count in JOINT_COUNTS}
    assert sizes.isdisjoint({pose_layout(FRAME).dtype.itemsize, stamp_layout(FRAME).dtype.itemsize})
    assert topic_of(memoryview(joints_layout(FRAME, joints).template)) == "/robot/joints"


def test_blocks_are_joined_whatever_an_empty_one_says_of_its_joints(joints: int) -> None:
    block = pose_block(5, joints)
    whole = joined([pose_block(0, 6), block, pose_block(0, 6), block])
    np.testing.assert_array_equal(whole.joints, np.concatenate([block.joints, block.joints]))


@pytest.mark.parametrize("count", [0, 5, 8])
def test_other_numbers_of_joints_are_refused(count: int) -> None:
    with pytest.raises(ValueError, match="a robot has 6 or 7"):
        RobotSpecification(joints=count)


def test_limits_of_another_number_of_joints_are_refused() -> None:
    with pytest.raises(ValueError, match="of 6 joints, the robot has 7"):
        RobotSpecification(joints=7, joint_limits=((-1.0, 1.0),) * 6)
