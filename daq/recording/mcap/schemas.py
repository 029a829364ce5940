"""The message types of a recording, as ROS 2 interface definitions with their dependencies.

The device's own counter, clock and status have no place in the standard messages. They travel beside each of them in
``retraction_msgs/DeviceStamp``, with the same MCAP sequence number and the same time.
"""

from typing import NamedTuple


class Schema(NamedTuple):
    """Name, encoding and text of a message type as MCAP stores them; without a name there is none of them."""

    name: str
    encoding: str
    text: str
    message_encoding: str


_RULE = "=" * 80
_HEADER = f"""{_RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_VECTOR = f"""{_RULE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""
_POINT = f"""{_RULE}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
"""
_QUATERNION = f"""{_RULE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""


def _ros2(name: str, text: str) -> Schema:
    return Schema(name, "ros2msg", text, "cdr")


WRENCH = _ros2(
    "geometry_msgs/msg/WrenchStamped",
    f"""std_msgs/Header header
geometry_msgs/Wrench wrench
{_HEADER}{_RULE}
MSG: geometry_msgs/Wrench
geometry_msgs/Vector3 force
geometry_msgs/Vector3 torque
{_VECTOR}""",
)

POSE = _ros2(
    "geometry_msgs/msg/PoseStamped",
    f"""std_msgs/Header header
geometry_msgs/Pose pose
{_HEADER}{_RULE}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{_POINT}{_QUATERNION}""",
)

POSE_ARRAY = _ros2(
    "geometry_msgs/msg/PoseArray",
    f"""std_msgs/Header header
geometry_msgs/Pose[] poses
{_HEADER}{_RULE}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{_POINT}{_QUATERNION}""",
)

JOINT_STATE = _ros2(
    "sensor_msgs/msg/JointState",
    f"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{_HEADER}""",
)

COMPRESSED_IMAGE = _ros2(
    "sensor_msgs/msg/CompressedImage",
    f"""std_msgs/Header header
string format
uint8[] data
{_HEADER}""",
)

IMAGE = _ros2(
    "sensor_msgs/msg/Image",
    f"""std_msgs/Header header
uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data
{_HEADER}""",
)

CAMERA_INFO = _ros2(
    "sensor_msgs/msg/CameraInfo",
    f"""std_msgs/Header header
uint32 height
uint32 width
string distortion_model
float64[] d
float64[9] k
float64[9] r
float64[12] p
uint32 binning_x
uint32 binning_y
sensor_msgs/RegionOfInterest roi
{_HEADER}{_RULE}
MSG: sensor_msgs/RegionOfInterest
uint32 x_offset
uint32 y_offset
uint32 height
uint32 width
bool do_rectify
""",
)

TRANSFORMS = _ros2(
    "tf2_msgs/msg/TFMessage",
    f"""geometry_msgs/TransformStamped[] transforms
{_RULE}
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
{_HEADER}{_RULE}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{_VECTOR}{_QUATERNION}""",
)

DEVICE_STAMP = _ros2(
    "retraction_msgs/msg/DeviceStamp",
    """# What a device itself says about the message of the same sequence number and time.
std_msgs/Header header
int64 counter          # the device's sample counter, unwrapped; -1 where it tells none
float64 device_time    # the device's clock, s; NaN where it tells none
int64 status           # force: status word; robot: 1 while it moves; camera: images that waited for the encoder
bool usable            # false where the device forbids using the sample
"""
    + _HEADER,
)

# JSON that explains itself: readers of ROS messages, which know no JSON schema, pass over a channel without one
EVENT = Schema("", "", "", "json")
