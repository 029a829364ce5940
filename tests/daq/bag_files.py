"""Bags as other programs write them: by the library rosbags, and by the MCAP project's own writer of ROS 2 messages."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mcap_ros2.writer import Writer as McapRos2Writer
from numpy.typing import NDArray
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

FloatArray = NDArray[np.float64]
STORE = get_typestore(Stores.ROS2_HUMBLE)
BEGIN_NS = 1_700_000_000_123_456_789

Message = tuple[str, int, Any]
"""Topic, log time in ns, and a message of ``STORE``."""


def made(kind: str, /, **fields: Any) -> Any:
    package, name = kind.split("/")
    return STORE.types[f"{package}/msg/{name}"](**fields)


def header(stamp_ns: int, frame: str = "") -> Any:
    stamp = made("builtin_interfaces/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return made("std_msgs/Header", stamp=stamp, frame_id=frame)


def xyz(kind: str, values: Sequence[float]) -> Any:
    return made(kind, **dict(zip("xyz", map(float, values), strict=True)))


def quaternion(values_xyzw: Sequence[float]) -> Any:
    return made("geometry_msgs/Quaternion", **dict(zip("xyzw", map(float, values_xyzw), strict=True)))


def wrench(stamp_ns: int, values: Sequence[float], frame: str = "ft_sensor") -> Any:
    force, torque = (xyz("geometry_msgs/Vector3", part) for part in (values[:3], values[3:]))
    return made(
        "geometry_msgs/WrenchStamped",
        header=header(stamp_ns, frame),
        wrench=made("geometry_msgs/Wrench", force=force, torque=torque),
    )


def plain_pose(position: Sequence[float], turn_xyzw: Sequence[float] = (0, 0, 0, 1)) -> Any:
    return made(
        "geometry_msgs/Pose",
        position=xyz("geometry_msgs/Point", position),
        orientation=quaternion(turn_xyzw),
    )


def pose(stamp_ns: int, position: Sequence[float], turn_xyzw: Sequence[float] = (0, 0, 0, 1)) -> Any:
    return made(
        "geometry_msgs/PoseStamped",
        header=header(stamp_ns, "base_link"),
        pose=plain_pose(position, turn_xyzw),
    )


def transform(stamp_ns: int, parent: str, child: str, position: Any, turn_xyzw: Any = (0, 0, 0, 1)) -> Any:
    return made(
        "geometry_msgs/TransformStamped",
        header=header(stamp_ns, parent),
        child_frame_id=child,
        transform=made(
            "geometry_msgs/Transform",
            translation=xyz("geometry_msgs/Vector3", position),
            rotation=quaternion(turn_xyzw),
        ),
    )


def transforms(*links: Any) -> Any:
    return made("tf2_msgs/TFMessage", transforms=list(links))


def joints(stamp_ns: int, names: Sequence[str], angles: Sequence[float]) -> Any:
    nothing = np.zeros(0)
    return made(
        "sensor_msgs/JointState",
        header=header(stamp_ns),
        name=list(names),
        position=np.asarray(angles, np.float64),
        velocity=nothing,
        effort=nothing,
    )


def cloud(stamp_ns: int, points: FloatArray, identities: Sequence[int] | None = None) -> Any:
    """Points (m, 3) as 32-bit numbers, with a padded step, and their identities where given."""
    kinds: list[tuple[str, str]] = [(axis, "<f4") for axis in "xyz"]
    if identities is not None:
        kinds.append(("id", "<u4"))
    record = np.dtype({"names": [n for n, _ in kinds], "formats": [k for _, k in kinds], "itemsize": 32})
    values = np.zeros(len(points), record)
    for place, axis in enumerate("xyz"):
        values[axis] = points[:, place]
    if identities is not None:
        values["id"] = identities
    described = [
        made("sensor_msgs/PointField", name=name, offset=record.fields[name][1], datatype=code, count=1)
        for (name, _), code in zip(kinds, (7, 7, 7, 6), strict=False)
    ]
    return made(
        "sensor_msgs/PointCloud2",
        header=header(stamp_ns, "base_link"),
        height=1,
        width=len(points),
        fields=described,
        is_bigendian=False,
        point_step=32,
        row_step=32 * len(points),
        data=np.frombuffer(values.tobytes(), np.uint8),
        is_dense=True,
    )


def marker(stamp_ns: int, number: int, position: Sequence[float]) -> Any:
    return made(
        "visualization_msgs/Marker",
        header=header(stamp_ns, "base_link"),
        ns="bead",
        id=number,
        type=2,
        action=0,
        pose=plain_pose(position),
        scale=xyz("geometry_msgs/Vector3", (0.003, 0.003, 0.003)),
        color=made("std_msgs/ColorRGBA", r=1.0, g=0.0, b=0.0, a=1.0),
        lifetime=made("builtin_interfaces/Duration", sec=0, nanosec=0),
        frame_locked=False,
        points=[],
        colors=[],
        texture_resource="",
        texture=made("sensor_msgs/CompressedImage", header=header(0), format="", data=np.zeros(0, np.uint8)),
        uv_coordinates=[],
        text="",
        mesh_resource="",
        mesh_file=made("visualization_msgs/MeshFile", filename="", data=np.zeros(0, np.uint8)),
        mesh_use_embedded_materials=False,
    )


def markers(stamp_ns: int, points: FloatArray) -> Any:
    return made(
        "visualization_msgs/MarkerArray",
        markers=[marker(stamp_ns, number, point) for number, point in enumerate(points)],
    )


def image(stamp_ns: int) -> Any:
    return made(
        "sensor_msgs/Image",
        header=header(stamp_ns, "camera"),
        height=4,
        width=6,
        encoding="mono8",
        is_bigendian=0,
        step=6,
        data=np.arange(24, dtype=np.uint8),
    )


def camera_info(stamp_ns: int) -> Any:
    return made(
        "sensor_msgs/CameraInfo",
        header=header(stamp_ns, "camera"),
        height=4,
        width=6,
        distortion_model="plumb_bob",
        d=np.array([0.1, 0.0, 0.0, 0.0, 0.0]),
        k=np.array([500.0, 0, 3, 0, 510.0, 2, 0, 0, 1]),
        r=np.eye(3).ravel(),
        p=np.eye(3, 4).ravel(),
        binning_x=0,
        binning_y=0,
        roi=made("sensor_msgs/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
    )


def text(words: str) -> Any:
    return made("std_msgs/String", data=words)


Options = tuple[StoragePlugin, CompressionMode | None]
BAGS: dict[str, Options] = {
    "sqlite3": (StoragePlugin.SQLITE3, None),
    "sqlite3, files compressed": (StoragePlugin.SQLITE3, CompressionMode.FILE),
    "sqlite3, messages compressed": (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
    "mcap": (StoragePlugin.MCAP, None),
    "mcap, files compressed": (StoragePlugin.MCAP, CompressionMode.FILE),
    "mcap, messages compressed": (StoragePlugin.MCAP, CompressionMode.MESSAGE),
    "mcap, chunks compressed": (StoragePlugin.MCAP, CompressionMode.STORAGE),
}


def write_bag(folder: Path, messages: Sequence[Message], kind: str = "mcap") -> Path:
    """A rosbag2 folder by the library rosbags."""
    plugin, compression = BAGS[kind]
    with_compression = Writer(folder, version=9, storage_plugin=plugin)
    if compression is not None:
        with_compression.set_compression(compression, CompressionFormat.ZSTD)
    with with_compression as bag:
        connections: dict[str, Any] = {}
        for topic, time_ns, message in messages:
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, message.__msgtype__, typestore=STORE)
            bag.write(connections[topic], time_ns, STORE.serialize_cdr(message, message.__msgtype__))
    return folder


def plain(value: Any) -> Any:
    """A message as mappings and lists."""
    if is_dataclass(value):
        return {
            one.name: plain(getattr(value, one.name)) for one in fields(value) if one.name != "__msgtype__"
        }
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [plain(one) for one in value] if isinstance(value, list) else value


def write_mcap(file: Path, messages: Sequence[Message]) -> Path:
    """A plain MCAP file by the writer of the MCAP project."""
    with file.open("wb") as stream:
        writer = McapRos2Writer(stream)
        known: dict[str, Any] = {}
        for place, (topic, time_ns, message) in enumerate(messages):
            kind = message.__msgtype__
            if kind not in known:
                known[kind] = writer.register_msgdef(
                    kind.replace("/msg/", "/"), STORE.generate_msgdef(kind, ros_version=2)[0]
                )
            writer.write_message(topic, known[kind], plain(message), time_ns, time_ns, place)
        writer.finish()
    return file


@dataclass(frozen=True)
class Trial:
    """A pull of a laboratory: at rest, then along x; in the robot's base, SI units.

    Attributes
    ----------
    time_ns : (n,) when the robot was there
    gripper : (n, 3)
    force : (n, 3) of the tissue on the gripper
    beads : (n, m, 3)
    """

    time_ns: NDArray[np.int64]
    gripper: FloatArray
    force: FloatArray
    beads: FloatArray


def trial(rows: int = 30, beads: int = 4) -> Trial:
    way = np.concatenate([np.zeros(5), np.linspace(0.0, 0.006, rows - 5)])
    moved = way[:, None] * np.array([1.0, 0.1, 0.0])
    rng = np.random.default_rng(3)
    rest = np.column_stack(
        [rng.uniform(-0.025, 0.01, beads), rng.uniform(-0.012, 0.012, beads), np.full(beads, 0.005)]
    )
    share = (rest[:, 0] + 0.03) / 0.054
    return Trial(
        BEGIN_NS + np.arange(rows) * 40_000_001,
        np.array([0.024, 0.0, 0.0]) + moved,
        -300.0 * moved,
        rest + share[:, None] * moved[:, None],
    )


def messages_of(one: Trial, late_ns: int = 700_000) -> Iterator[Message]:
    """Pose and beads of the trial, the force at four times the rate, each received a little later than stamped."""
    for place, time_ns in enumerate(one.time_ns.tolist()):
        yield "/arm/tool_pose", time_ns + late_ns, pose(time_ns, one.gripper[place])
        yield "/beads", time_ns + late_ns, cloud(time_ns, one.beads[place])
    fast = np.arange(one.time_ns[0], one.time_ns[-1], 10_000_000)
    for stamp in fast.tolist():
        now = [np.interp(stamp, one.time_ns, one.force[:, axis]) for axis in range(3)]
        yield "/ft/wrench", stamp + late_ns, wrench(stamp, [*now, 0.0, 0.0, 0.0])


Change = Callable[[list[Message]], list[Message]]
