"""``retract emulate``: every kind, met over its own wire by its driver."""

import argparse
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager

import can
import numpy as np
import pytest
from gige_cameras import address, need_aravis

from daq.cli import main
from robot_drivers.abb.irb140 import IRB140, IRB140Settings
from robot_drivers.ati.axia import Axia, AxiaSettings
from robot_drivers.ati.controller_ft import ControllerFT, ControllerFTSettings
from robot_drivers.ati.digital_ft import DigitalFT, DigitalFTSettings
from robot_drivers.ati.netft import NetFT, NetFTSettings
from robot_drivers.bota import BotaSerial, BotaSettings
from robot_drivers.cameras.depth import depth_m
from robot_drivers.cameras.opencv import OpenCVCamera
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.emulators import KINDS
from robot_drivers.emulators.options import add_options, read_options
from robot_drivers.genicam import GenICamCamera, GenICamSettings
from robot_drivers.universal_robots import URRobot, URSettings, URWrench, URWrenchSettings

posix = pytest.mark.skipif(
    sys.platform == "win32", reason="pseudo-terminals and SIGINT are a matter of POSIX"
)


ANSWER_TIMEOUT_S = 2.0  # a busy machine lets emulated devices answer late


@contextmanager
def emulated(name: str, *arguments: str) -> Iterator[str]:
    """Run an emulator in this process, with options as the command line has them; give where it listens."""
    kind, parser = KINDS[name], argparse.ArgumentParser()
    for title, settings in kind.options.items():
        add_options(parser, title, settings, kind.flags)
    options = parser.parse_args(arguments)
    with kind.start(*(read_options(options, settings) for settings in kind.options.values())) as running:
        yield running.where


@contextmanager
def process(*arguments: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Run ``retract emulate`` as a process of its own and give the line that it prints."""
    command = [sys.executable, "-m", "daq.cli", "emulate", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        try:
            yield running.stdout.readline(), running
        finally:
            running.send_signal(signal.SIGINT)
            running.communicate(timeout=20)


def port(line: str, name: str) -> int:
    return int(re.search(rf"{name} (\d+)", line)[1])


def first_block(sensor):
    sensor.connect()
    sensor.start()
    return sensor.read(5.0)


@posix
def test_it_says_where_it_listens_holds_still_and_ends_on_an_interrupt() -> None:
    with process("netft") as (line, running):
        assert "127.0.0.1" in line
        assert line.endswith("Ctrl-C ends it\n")
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=20)
        assert (running.returncode, out) == (130, "")
        assert err == "retract: interrupted\n"


@posix
def test_a_net_ft_box_is_found_at_its_ports_and_feels_its_load() -> None:
    with emulated("netft", "--wrench", "1", "2", "3", "0.1", "0.2", "0.3", "--rate-hz", "500") as line:
        settings = NetFTSettings(
            host="127.0.0.1",
            rdt_port=port(line, "RDT UDP"),
            http_port=port(line, "web TCP"),
            request_pause_s=0.01,
        )
        with closing(NetFT(settings)) as sensor:
            wrench = first_block(sensor).wrench[0]
    np.testing.assert_allclose(wrench, [1, 2, 3, 0.1, 0.2, 0.3], atol=0.1)


@posix
def test_an_axia_is_found_at_its_ports_and_samples_at_its_rate() -> None:
    with emulated("axia", "--wrench", "1", "2", "3", "0.1", "0.2", "0.3", "--sample-rate-hz", "976") as line:
        settings = AxiaSettings(
            host="127.0.0.1",
            rdt_port=port(line, "RDT UDP"),
            http_port=port(line, "web TCP"),
            rate_hz=488,
            request_pause_s=0.01,
        )
        with closing(Axia(settings)) as sensor:
            wrench = first_block(sensor).wrench[0]
            assert sensor.identity.details["sample rate"] == "976 Hz"
    np.testing.assert_allclose(wrench, [1, 2, 3, 0.1, 0.2, 0.3], atol=0.1)


@posix
@pytest.mark.parametrize("kind", ["digital_ft", "controller_ft"])
def test_a_serial_sensor_is_found_at_its_pseudo_terminal(kind: str) -> None:
    with emulated(kind, "--wrench", "5", "0", "0", "0", "0", "0") as line:
        terminal = re.search(r"on (\S+):", line)[1]
        if kind == "digital_ft":
            sensor = DigitalFT(DigitalFTSettings(port=terminal, answer_timeout_s=ANSWER_TIMEOUT_S))
        else:
            sensor = ControllerFT(
                ControllerFTSettings(
                    port=terminal,
                    counts_per_newton=10.0,
                    counts_per_newton_metre=500 / 3,
                    answer_timeout_s=ANSWER_TIMEOUT_S,
                )
            )
        with closing(sensor):
            wrench = first_block(sensor).wrench[0]
    np.testing.assert_allclose(wrench, [5, 0, 0, 0, 0, 0], atol=0.11)


@posix
def test_a_bota_sensor_is_found_at_its_pseudo_terminal() -> None:
    with emulated("bota", "--wrench", "5", "0", "0", "0", "0", "0", "--sinc-length", "512") as line:
        terminal = re.search(r"on (\S+):", line)[1]
        with closing(BotaSerial(BotaSettings(port=terminal, start_timeout_s=20.0))) as sensor:
            wrench = first_block(sensor).wrench[0]
            assert sensor.identity.details["rate"] == "100 Hz (measured)"
    np.testing.assert_allclose(wrench, [5, 0, 0, 0, 0, 0], atol=0.3)


@posix
def test_a_can_board_is_found_behind_its_serial_adapter() -> None:
    with emulated("netcanoem", "--serial", "FT1") as line:
        terminal = re.search(r"slcan (\S+)", line)[1]
        with can.Bus(interface="slcan", channel=terminal, bitrate=250_000, sleep_after_open=0.0) as bus:
            bus.send(can.Message(arbitration_id=0x205, is_extended_id=False))
            answer = next(message for message in bus if message.arbitration_id == 0x205)
    assert bytes(answer.data) == b"FT1" + bytes(5)


def test_an_emulated_ur_answers_both_of_its_drivers() -> None:
    with emulated("ur", "--arm", "UR3e", "--wrench", "0", "0", "-5", "0", "0", "0") as line:
        address = ("127.0.0.1", port(line, "TCP"))
        with (
            closing(URRobot(URSettings(*address, arm="UR3e"))) as robot,
            closing(URWrench(URWrenchSettings(*address, arm="UR3e"))) as sensor,
        ):
            robot.connect()
            assert robot.state().motors_on
            assert first_block(sensor).wrench[0, 2] == pytest.approx(-5.0, abs=0.1)


@posix
def test_a_controller_answers_its_driver_and_moves_nothing() -> None:
    with emulated("irb140", "--serial", "140-1") as line:
        settings = IRB140Settings(
            host="127.0.0.1", command_port=port(line, "commands TCP"), state_port=port(line, "state TCP")
        )
        with closing(IRB140(settings)) as robot:
            robot.connect()
            assert robot.identity.serial == "140-1"
            assert not robot.state().moving


@posix
def test_guidance_without_a_pc_ends_with_the_event_of_the_controller() -> None:
    with process("irb140", "--egm", "127.0.0.1:9", "--guidance", "pose", "--comm-timeout-s", "0.1") as (
        _,
        running,
    ):
        assert "41822" in running.stderr.readline()


@posix
def test_a_camera_that_loses_images_counts_them() -> None:
    size = ["--width", "80", "--height", "60", "--fps", "50"]
    with emulated("camera", *size, "--loss", "0.5", "--image-seed", "3") as line:
        url = re.search(r"tcp://[\d.:]+\d", line)[0]
        with closing(
            OpenCVCamera(OpenCVCameraSettings(url, embedded_info=("timestamp", "frame_counter")))
        ) as camera:
            camera.connect()
            while camera.statistics().received < 10:
                camera.read(2.0)
            assert camera.statistics().lost > 0


@posix
def test_a_gige_camera_is_found_at_its_address() -> None:
    need_aravis()
    host = address()
    with emulated("gige", "--host", host, "--width", "80", "--height", "60", "--fps", "50"):
        settings = GenICamSettings(camera=host, chunk_timestamps=True, ptp=True, open_timeout_s=20.0)
        with closing(GenICamCamera(settings)) as camera:
            camera.connect()
            assert camera.identity.details["PTP"] == "Slave"
            assert camera.read(5.0)[0].image.shape == (60, 80)


@posix
def test_a_gige_camera_with_depth_tells_what_it_counts_in() -> None:
    need_aravis()
    host = address()
    with emulated("gige_depth", "--host", host, "--scale", "0.1", "--offset", "100", "--mode", "RectifiedC"):
        settings = GenICamSettings(camera=host, depth=True, open_timeout_s=20.0)
        with closing(GenICamCamera(settings)) as camera:
            camera.connect()
            depth = camera.read(5.0)[0].depth
            assert depth is not None
            assert np.median(depth_m(depth.counts, depth.scale)) == pytest.approx(2.1, abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_help_with_an_example_and_its_faults(
    kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["emulate", kind, "--help"])
    told = capsys.readouterr().out
    assert f"retract emulate {kind} --" in told
    assert "faults:" in told


@pytest.mark.parametrize("kind", KINDS)
def test_no_emulator_listens_beyond_this_computer_unless_told(kind: str) -> None:
    for settings in KINDS[kind].options.values():
        for field in ("host", "bind_address"):
            if field in settings.__dataclass_fields__:
                assert settings.__dataclass_fields__[field].default == "127.0.0.1"


def test_a_port_that_another_program_has_is_named_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["emulate", "ur", "--port", str(port)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("retract: Address already in use")
    assert str(port) in line


def test_an_unknown_kind_and_a_wrong_option_end_with_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["emulate", "nanoft"], ["emulate", "netft", "--loss", "much"]):
        with pytest.raises(SystemExit, match="2"):
            main(arguments)
    assert main(["emulate", "irb140", "--egm", "nowhere"]) == 2
    assert "must be HOST:PORT" in capsys.readouterr().err
