"""A session as a rosbag2 folder, read by a reader that knows ROS 2 alone."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation
from synthetic_session import SyntheticSession

from daq.bad_input.samples.sessions import Extent, cut_session
from daq.cli import main
from daq.export import export_ros2
from daq.progress import silent
from daq.recording.folder import SessionInfo, seal_session, write_info
from daq.recording.mcap import schemas
from daq.recording.mcap.chunks import Rows
from daq.recording.mcap.log import McapLog
from daq.recording.messages.codec import compressed
from daq.recording.messages.rows import FrameRows, WrenchRows, camera_info_row
from daq.recording.reader import Recording
from daq.rig import read_rig
from daq.synchronisation.experiment_rows import gripper_in_tissue
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.rendering.scene import flea2_pair
from robot_drivers.protocols import Frame, Pose, WrenchBlock

TYPES = {
    "/force/wrench": "geometry_msgs/msg/WrenchStamped",
    "/robot/pose": "geometry_msgs/msg/PoseStamped",
    "/robot/joints": "sensor_msgs/msg/JointState",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/camera/left/image": "sensor_msgs/msg/CompressedImage",
    "/camera/right/image": "sensor_msgs/msg/CompressedImage",
}


@pytest.fixture
def session(tmp_path: Path) -> Path:
    cut_session(tmp_path, Extent(samples=600, samples_in_chunk=60, images=6))
    return tmp_path / "session"


def messages(bag: Path) -> dict[str, list]:
    """Stamp of the log and message, by topic."""
    found: dict[str, list] = {}
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, time_ns, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            found.setdefault(connection.topic, []).append((time_ns, message))
    return found


def test_a_reader_of_ros_2_finds_every_sample_with_its_wall_clock_time(session: Path, tmp_path: Path) -> None:
    assert main(["export", str(session), "--format", "ros2", "--output", str(tmp_path / "bag")]) == 0
    found = messages(tmp_path / "bag")
    recording = Recording(session)
    assert found.keys() == TYPES.keys()
    anchor = recording.info.clock_anchor
    expected = recording.force.host_time_ns - anchor.host_time_ns + anchor.wall_time_ns
    times = [time_ns for time_ns, _ in found["/force/wrench"]]
    assert times == expected.tolist()
    stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for _, m in found["/force/wrench"]]
    assert stamps == times
    forces = [[m.wrench.force.x, m.wrench.force.z, m.wrench.torque.y] for _, m in found["/force/wrench"]]
    np.testing.assert_array_equal(forces, recording.force.wrench[:, [0, 2, 4]])
    poses = [[m.pose.position.x, m.pose.orientation.w] for _, m in found["/robot/pose"]]
    assert poses == [[x, w] for (x, _, _), (w, *_) in zip(
        recording.robot.position.tolist(), recording.robot.quaternion_wxyz.tolist(), strict=True
    )]  # fmt: skip
    joints = found["/robot/joints"][0][1]
    assert (list(joints.name), list(joints.position)) == ([f"joint_{n}" for n in range(1, 7)], [0.0] * 6)
    for place, (_, image) in enumerate(found["/camera/left/image"]):
        pixels = cv2.imdecode(np.asarray(image.data), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(pixels, recording.images("left").image(place))


def test_the_file_is_of_standard_messages_alone_and_whole(session: Path, tmp_path: Path) -> None:
    bag = export_ros2(session, tmp_path / "bag", silent)
    with next((tmp_path / "bag").glob("*.mcap")).open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary is not None
        assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
        assert {channel.message_encoding for channel in summary.channels.values()} == {"cdr"}
        kinds = {one.topic: summary.schemas[one.schema_id].name for one in summary.channels.values()}
        assert kinds == TYPES
        assert sum(1 for _ in reader.iter_messages()) == sum(bag.messages.values())


def test_samples_that_may_not_be_used_are_left_out_and_counted(tmp_path: Path) -> None:
    session = written(tmp_path, wrench=True)
    bag = export_ros2(session, tmp_path / "bag", silent)
    assert (bag.messages["/force/wrench"], bag.unusable) == (8, 2)
    assert [m.wrench.force.x for _, m in messages(tmp_path / "bag")["/force/wrench"]] == [
        0,
        1,
        2,
        3,
        5,
        6,
        7,
        8,
    ]


def test_a_mosaic_is_one_image_and_the_intrinsics_come_along(tmp_path: Path) -> None:
    session = written(tmp_path, wrench=False)
    export_ros2(session, tmp_path / "bag", silent)
    found = messages(tmp_path / "bag")
    ((_, image),) = found["/camera/left/image"]
    assert image.format == "bayer_rggb8; png compressed"
    np.testing.assert_array_equal(cv2.imdecode(np.asarray(image.data), cv2.IMREAD_UNCHANGED), MOSAIC)
    ((_, info),) = found["/camera/left/camera_info"]
    model = flea2_pair().left
    assert (info.height, info.width, info.k[0]) == (model.height, model.width, model.intrinsic_matrix[0, 0])


def test_transforms_tell_where_the_frames_of_the_messages_are(tmp_path: Path) -> None:
    turn = Rotation.from_euler("z", 30, degrees=True)
    poses = (Pose((0.04, 0.0, 0.0)), Pose((0.043, 0.0, 0.0), tuple(turn.as_quat(scalar_first=True))))
    session = SyntheticSession(poses, SpringPhantom(GRASP_CENTRE, placed_beads(3))).write(
        tmp_path / "session"
    )
    seal_session(session)
    export_ros2(session, tmp_path / "bag", silent)
    found = messages(tmp_path / "bag")
    ((_, static),) = found["/tf_static"]
    links = {(one.header.frame_id, one.child_frame_id): one.transform for one in static.transforms}
    assert links.keys() == {("robot_base", "tissue"), ("tool", "gripper"), ("gripper", "force_sensor")}
    base_tool = [message.transforms[0] for _, message in found["/tf"]]
    assert {(one.header.frame_id, one.child_frame_id) for one in base_tool} == {("robot_base", "tool")}
    assert found["/force/wrench"][0][1].header.frame_id == "force_sensor"
    assert found["/robot/pose"][0][1].header.frame_id == "robot_base"
    # where the recording puts the gripper in the tissue is where the transforms put it
    recording, rig = Recording(session), read_rig(session / "rig.toml", to_connect=False)
    expected, _ = gripper_in_tissue(recording.robot, rig.frames)
    R_tissue, tissue = placed(links[("robot_base", "tissue")])
    _, gripper = placed(links[("tool", "gripper")])
    for place in (0, len(base_tool) - 1):
        R_tool, tool = placed(base_tool[place].transform)
        in_tissue = R_tissue.inv().apply(tool + R_tool.apply(gripper) - tissue)
        np.testing.assert_allclose(in_tissue, expected[place], atol=1e-12)
    static_topic = next(
        one["topic_metadata"]
        for one in described(tmp_path / "bag")["topics_with_message_count"]
        if one["topic_metadata"]["name"] == "/tf_static"
    )
    (quality,) = json.loads(static_topic["offered_qos_profiles"])
    assert quality["durability"] == 1  # transient local: told again to those who come later


def placed(transform: object) -> tuple[Rotation, np.ndarray]:
    turn, place = transform.rotation, transform.translation
    return Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]), np.array([place.x, place.y, place.z])


def described(bag: Path) -> dict:
    return YAML(typ="safe").load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]


def test_the_description_is_as_rosbag2_reads_it(session: Path, tmp_path: Path) -> None:
    """Every key that ``rosbag2_storage/yaml.hpp`` asks for in version 5, and the counts of what is there."""
    bag = export_ros2(session, tmp_path / "bag", silent)
    told = described(tmp_path / "bag")
    assert told["version"] == 5
    assert told["storage_identifier"] == "mcap"
    assert told["message_count"] == sum(bag.messages.values())
    assert {
        one["topic_metadata"]["name"]: one["message_count"] for one in told["topics_with_message_count"]
    } == dict(bag.messages)
    for topic in told["topics_with_message_count"]:
        assert topic["topic_metadata"].keys() == {
            "name",
            "type",
            "serialization_format",
            "offered_qos_profiles",
        }
    (file,) = told["files"]
    assert (tmp_path / "bag" / file["path"]).is_file()
    assert {"compression_format", "compression_mode", "starting_time", "duration"} <= told.keys()


MOSAIC = np.random.default_rng(0).integers(0, 255, (16, 24), np.uint8)


def written(folder: Path, wrench: bool) -> Path:
    session = folder / "session"
    session.mkdir()
    write_info(session, SessionInfo("s", "P1", 1))
    with McapLog(session / "signals.mcap") as log:
        if wrench:
            log.append(_wrench(log))
    with McapLog(session / "cameras.mcap") as log:
        info = log.add_channel("/camera/left/camera_info", schemas.CAMERA_INFO)
        log.append(camera_info_row(info, "camera_left", flea2_pair().left, 10**15))
        rows = FrameRows(
            log.add_channel("/camera/left/image", schemas.COMPRESSED_IMAGE),
            log.add_channel("/camera/left/image_raw", schemas.IMAGE),
            log.add_channel("/camera/left/device", schemas.DEVICE_STAMP),
            "camera_left",
        )
        log.append(rows.pack(compressed(Frame(0, 0.0, 10**15, "bayer_rggb8", MOSAIC)), 0))
    seal_session(session)
    return session


def _wrench(log: McapLog) -> Rows:
    channels = (
        log.add_channel("/force/wrench", schemas.WRENCH),
        log.add_channel("/force/device", schemas.DEVICE_STAMP),
    )
    number = np.arange(10)
    block = WrenchBlock(
        counter=number,
        device_time_s=number * 1e-3,
        host_time_ns=10**15 + number * 1_000_000,
        status=np.zeros(10, np.int64),
        usable=number % 5 != 4,
        wrench=np.outer(number, np.ones(6)),
    )
    return WrenchRows(*channels, "force_sensor").pack(block, 0)
