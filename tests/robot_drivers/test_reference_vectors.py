"""Byte vectors and sizes of manuals and captures that no other test holds.

Those of RDT are in test_ati_rdt, of the command interface in test_ati_command_interface, of the native CAN protocol in
test_ati_netbox_can, of NETCANOEM in test_ati_netcanoem, of Modbus in test_serial_modbus, of the Digital F/T in
test_serial_digital_ft and test_serial_gages, of the stand-alone controller in test_serial_controller_ft, of EGM in
test_abb_egm_codec and test_abb_egm_stream, of the arm in test_abb_kinematics.
"""

import socket

import pytest

from robot_drivers.abb.egm.codec import (
    EgmCartesian,
    EgmCartesianSpeed,
    EgmEuler,
    EgmHeader,
    EgmJoints,
    EgmMotion,
    EgmPose,
    EgmQuaternion,
    EgmRobot,
    EgmSensor,
    EgmSpeedRef,
    decode_robot,
    decode_sensor,
)
from robot_drivers.abb.egm.guidance_session import EGMGuidanceSettings, GuidanceSession
from robot_drivers.abb.egm.position_stream import EGMSettings, to_sample
from robot_drivers.abb.egm.protobuf import encode
from robot_drivers.abb.emulator.arm import Arm
from robot_drivers.abb.emulator.egm import ControllerSample, robot_message
from robot_drivers.abb.emulator.settings import ArmSettings
from robot_drivers.ati.emulator import EmulatorSettings, NetFTEmulator
from robot_drivers.ati.rdt import protocol as rdt
from robot_drivers.errors import ConfigurationError

MULTICAST = bytes.fromhex("12 34 80 02 00 00 00 00 E0 00 05 80 6E 5A")


def test_a_request_for_a_multicast_group_has_the_bytes_of_the_manual() -> None:
    assert rdt.request_for(rdt.Command.START_REAL_TIME, ("224.0.5.128", 28250)) == MULTICAST


@pytest.mark.parametrize(
    "destination", [("sensor", 1), ("10.0.0.256", 1), ("10.0.0.1", 65536), ("10.0.0.1", -1)]
)
def test_a_destination_that_is_none_is_refused(destination: tuple[str, int]) -> None:
    with pytest.raises(ConfigurationError, match="RDT destination"):
        rdt.request_for(rdt.Command.START_REAL_TIME, destination)


def test_the_emulated_box_streams_to_the_destination_and_not_to_who_asked() -> None:
    with (
        NetFTEmulator(lambda _: [0.0] * 6, EmulatorSettings(noise_std=(0.0,) * 6)) as box,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening,
    ):
        for end in (asking, listening):
            end.bind(("127.0.0.1", 0))
            end.settimeout(5.0)
        request = rdt.request_for(rdt.Command.START_REAL_TIME, listening.getsockname())
        asking.sendto(request, ("127.0.0.1", box.rdt_port))
        assert len(listening.recv(100)) == 36
        asking.settimeout(0.05)
        with pytest.raises(TimeoutError):
            asking.recv(100)


@pytest.mark.parametrize(("generation", "sizes"), [("B", {301}), ("B'", {367, 368, 369})])
def test_the_emulated_controller_sends_messages_of_the_sizes_seen(generation: str, sizes: set[int]) -> None:
    reading = Arm(ArmSettings()).measure()
    message = robot_message(generation, 0, ControllerSample(28397216500, reading, reading))
    assert len(encode(message)) in sizes


def test_the_smallest_pose_answer_has_77_bytes_and_one_with_joints_euler_and_speed_279() -> None:
    pose = EgmPose(EgmCartesian(450.0, 20.0, 600.0), EgmQuaternion(1.0, 0.0, 0.0, 0.0))
    smallest = EgmSensor(EgmHeader(seqno=0, mtype=3), EgmMotion(cartesian=pose))
    assert decode_sensor(encode(smallest)) == smallest
    assert len(encode(smallest)) == 77
    joints = EgmJoints((0.0,) * 6)
    whole = EgmSensor(
        EgmHeader(0, 0, 3),
        EgmMotion(joints=joints, cartesian=EgmPose(pose.pos, pose.orient, EgmEuler(0.0, 0.0, 0.0))),
        EgmSpeedRef(joints=joints, cartesians=EgmCartesianSpeed((0.0,) * 6)),
    )
    assert decode_sensor(encode(whole)) == whole
    assert len(encode(whole)) == 279


def test_the_answer_of_guidance_to_the_captured_datagram_is_its_own_pose() -> None:
    motion = (
        "0a36 090000000000000000 090000000000002440 090000000000003440 090000000000000000 090000000000804640"
        "090000000000000000 1243 0a1b 090000000000207c40 110000000000003440 190000000000c08240"
        "1224 09000000000000f03f 110000000000000000 190000000000000000 210000000000000000 2208 08eddd01 10b49b0d"
    )
    datagram = bytes.fromhex(
        f"0a09080010a59dc50d1802 12 8701 {motion} 1a 8701 {motion} 22020801 2a020803 3000 42020802"
    )
    message: EgmRobot = decode_robot(datagram)
    sample = to_sample(message, 0, EGMSettings().untimed_joint_unit)
    answer = GuidanceSession(EGMGuidanceSettings()).answer(sample, message, 0)
    assert answer is not None
    sensor = decode_sensor(answer)
    assert sensor.header is not None
    assert sensor.header.mtype == 3
    assert sensor.planned == EgmMotion(
        cartesian=EgmPose(EgmCartesian(450.0, 20.0, 600.0), EgmQuaternion(1.0, 0.0, 0.0, 0.0))
    )
