"""Opening a session with the robot: connect, check that both sides mean the same, choose the pose source."""

import contextlib
import math
from dataclasses import dataclass, field, replace
from typing import Protocol

from robot_drivers.abb.egm.position_stream import EGMSample, EGMSettings, PositionStream
from robot_drivers.abb.motion.limits import MotionLimits
from robot_drivers.abb.motion.tool_data import SAME_ANGLE, SAME_POSITION, check_tool_data
from robot_drivers.abb.rapid_socket.codes import Command, ReplyKind
from robot_drivers.abb.rapid_socket.command_connection import CommandConnection, ConnectionSettings
from robot_drivers.abb.rapid_socket.frames import PROTOCOL_VERSION, Reply, TextReply, limit_numbers
from robot_drivers.abb.rapid_socket.state_stream import StateStream
from robot_drivers.clock import host_time_ns, seconds_until
from robot_drivers.errors import ConfigurationError, DeviceFaultError, DeviceProtocolError
from robot_drivers.motion import poses
from robot_drivers.protocols import DeviceIdentity, Pose, PoseBlock, StreamStatistics


@dataclass(frozen=True, slots=True)
class IRB140Settings:
    """How to reach the robot and what it may do.

    Attributes
    ----------
    host : address of the controller
    command_port, state_port : TCP ports of the RAPID server
    egm : where the controller sends its EGM position stream; None if it has no EGM. Without a controller
        address of its own it must come from ``host``
    egm_wait_s : how long connecting waits for that stream before it takes the state stream
    limits : bounds of every motion
    T_flange_tool : the tool data of the controller, checked against it on connect (default: ABB's tool0)
    position_tolerance, angle_tolerance : how far from its target (m, rad) a finished motion may stand
    connect_timeout_s, heartbeat_period_s, silence_limit_s : of the command connection
    """

    host: str
    command_port: int = 5000
    state_port: int = 5001
    egm: EGMSettings | None = field(default_factory=EGMSettings)
    egm_wait_s: float = 1.0
    limits: MotionLimits = field(default_factory=MotionLimits)
    T_flange_tool: Pose = poses.IDENTITY
    position_tolerance: float = 2e-4
    angle_tolerance: float = math.radians(0.05)
    connect_timeout_s: float = 3.0
    heartbeat_period_s: float = 0.1
    silence_limit_s: float = 1.0


class PoseSource(Protocol):
    """A stream of poses."""

    def read(self, timeout_s: float) -> PoseBlock:
        """Return what arrived since the last call; wait up to ``timeout_s`` for a first sample."""

    def statistics(self) -> StreamStatistics:
        """Return the counts."""

    def close(self) -> None:
        """End the stream."""


@dataclass(frozen=True, slots=True)
class Session:
    """A connection that was checked: commands, poses, and who is at the other end."""

    command: CommandConnection
    source: PoseSource
    identity: DeviceIdentity


def open_session(settings: IRB140Settings, motion_forbidden: bool) -> Session:
    """Connect and check; raises what :meth:`robot_drivers.abb.irb140.IRB140.connect` raises, and leaves nothing open.

    ``motion_forbidden`` carries a hold over from an earlier session.
    """
    with contextlib.ExitStack() as opened:
        command = CommandConnection(_connection_settings(settings), motion_forbidden)
        opened.callback(command.close)
        hello = done(command.request(Command.HELLO), "HELLO")
        if hello.detail != PROTOCOL_VERSION:
            raise DeviceProtocolError(
                f"the RAPID modules speak protocol version {hello.detail:g}, this driver "
                f"{PROTOCOL_VERSION}; load the modules that came with it"
            )
        check_tool_data(settings.T_flange_tool, hello.joints, hello.T_base_tool)
        done(command.request(Command.SET_LIMITS, limit_numbers(settings.limits)), "SET_LIMITS")
        words = command.request_text(Command.IDENTIFY)
        source, description = _open_source(settings, command)
        opened.pop_all()
        return Session(command, source, _describe(settings, words, description))


def done(reply: Reply | TextReply, request: str) -> Reply:
    """Return the reply to a request that was carried out; raises DeviceFaultError for any other."""
    if isinstance(reply, TextReply):
        raise DeviceProtocolError(f"text in answer to {request}")
    if reply.kind is not ReplyKind.DONE:
        raise DeviceFaultError(f"the controller answered {request} with {reply.kind.name}: {reply.cause}")
    return reply


def _connection_settings(settings: IRB140Settings) -> ConnectionSettings:
    return ConnectionSettings(
        settings.host,
        settings.command_port,
        settings.connect_timeout_s,
        settings.heartbeat_period_s,
        settings.silence_limit_s,
    )


def _open_source(settings: IRB140Settings, command: CommandConnection) -> tuple[PoseSource, str]:
    if settings.egm is not None:
        address = settings.egm.controller_address or settings.host
        with contextlib.ExitStack() as opened:
            stream = PositionStream(replace(settings.egm, controller_address=address))
            stream.open()
            opened.callback(stream.close)
            deadline_ns = host_time_ns() + round(settings.egm_wait_s * 1e9)
            while not (samples := stream.receive(seconds_until(deadline_ns))):
                if host_time_ns() >= deadline_ns:
                    break
            if samples:
                _check_same_pose(samples[-1], done(command.request(Command.GET_STATE), "GET_STATE"))
                opened.pop_all()
                return stream, f"EGM position stream, layout {stream.generation}"
    state_stream = StateStream(settings.host, settings.state_port, settings.connect_timeout_s)
    return state_stream, "RAPID state stream"


def _check_same_pose(sample: EGMSample, state: Reply) -> None:
    """Refuse an EGM stream of another tool, work object or angle unit than that of the RAPID server."""
    position, angle = poses.distance(sample.pose, state.T_base_tool)
    joints = max(abs(a - b) for a, b in zip(sample.joints, state.joints, strict=True))
    if position > SAME_POSITION or max(angle, joints) > SAME_ANGLE:
        raise ConfigurationError(
            f"EGM reports the tool {position * 1e3:.1f} mm and {math.degrees(angle):.1f}° and a joint "
            f"{math.degrees(joints):.1f}° from what the RAPID server reports; give both the same tool and work "
            "object, and check the unit of EGM joints without time"
        )


def _describe(settings: IRB140Settings, words: str, pose_source: str) -> DeviceIdentity:
    serial, robotware, robot_type = [*words.split("*"), "", ""][:3]
    return DeviceIdentity(
        kind="robot",
        model="ABB IRB 140",
        serial=serial,
        address=f"{settings.host}:{settings.command_port}",
        details={"robotware": robotware, "robot_type": robot_type, "pose_source": pose_source},
    )
