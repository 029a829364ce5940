"""GenICam cameras: the driver through Aravis on an emulated GigE Vision camera, and on the fake one of Aravis."""

import socket
import struct
import subprocess
import sys
import time
from contextlib import closing, contextmanager

import numpy as np
import pytest
from gige_cameras import address, gige_camera, need_aravis
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.errors import (
    ConfigurationError,
    DeviceError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)
from robot_drivers.genicam import DRIVER, GenICamCamera, GenICamSettings
from robot_drivers.genicam.camera import FrameNumbers
from robot_drivers.genicam.emulator import GigEFaults

PATIENCE_S = 30.0


@pytest.fixture(autouse=True)
def aravis():
    need_aravis()


@contextmanager
def connected(emulator, **settings):
    with closing(GenICamCamera(settings_of(emulator, **settings))) as camera:
        camera.connect()
        yield camera


def settings_of(emulator, **settings):
    return GenICamSettings(camera=emulator.settings.host, **{"open_timeout_s": PATIENCE_S, **settings})


def frames_of(camera, count):
    frames, end = [], time.monotonic() + PATIENCE_S
    while len(frames) < count:
        assert time.monotonic() < end, f"only {len(frames)} images came"
        frames += camera.read(1.0)
    return frames


# ---- what it delivers


@pytest.mark.parametrize("chunk_timestamps", [False, True])
@pytest.mark.parametrize("size", [(160, 120), (33, 17), (1280, 960)])
def test_images_come_bit_for_bit_with_number_and_time(size, chunk_timestamps):
    width, height = size
    random = np.random.default_rng(3).integers(0, 256, (height, width), np.uint8)
    with (
        gige_camera(lambda _: random, width=width, height=height) as emulator,
        connected(emulator, chunk_timestamps=chunk_timestamps) as camera,
    ):
        frames = frames_of(camera, 5)
    for frame in frames:
        np.testing.assert_array_equal(frame.image, random)
    steps = np.diff([frame.counter for frame in frames])
    np.testing.assert_allclose(np.diff([frame.device_time_s for frame in frames]), steps * 0.02, atol=1e-6)


@pytest.mark.parametrize("pixel_format", ["BayerRG8", "BayerGB8"])
def test_a_mosaic_keeps_its_name(pixel_format):
    ours = {"BayerRG8": "bayer_rggb8", "BayerGB8": "bayer_gbrg8"}[pixel_format]
    with gige_camera(pixel_format=pixel_format) as emulator, connected(emulator, pixel_format=ours) as camera:
        assert frames_of(camera, 1)[0].pixel_format == ours


def test_the_identity_is_what_the_camera_tells():
    with gige_camera(vendor="Lab", model="Cam 7", serial="S42") as emulator, connected(emulator) as camera:
        identity = camera.identity
    assert (identity.model, identity.serial, identity.address) == ("Lab Cam 7", "S42", emulator.settings.host)
    assert identity.details == {
        "width": "160",
        "height": "120",
        "pixel_format": "mono8",
        "times": "stream",
        "fps": "50",
    }


def test_the_chunk_is_the_source_of_the_time_only_where_it_is_asked_for():
    with gige_camera() as emulator:
        for chunk_timestamps, enabled in ((False, 0), (True, 1)):
            with connected(emulator, chunk_timestamps=chunk_timestamps) as camera:
                frames_of(camera, 1)
                assert emulator.settings.chunks
                assert read_register(emulator, 0x801C) == enabled


def read_register(emulator, register):
    """Ask the camera over a plain socket, as the protocol's dissector would have it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plain:
        plain.settimeout(PATIENCE_S)
        plain.sendto(struct.pack(">BBHHHI", 0x42, 1, 0x80, 4, 7, register), (emulator.settings.host, 3956))
        answer = plain.recv(100)
    assert answer[:8] == struct.pack(">HHHH", 0, 0x81, 4, 7)
    return struct.unpack(">I", answer[8:])[0]


# ---- one clock for several cameras


def test_cameras_that_follow_the_network_have_one_clock():
    with (
        gige_camera(clock_ppm=500.0) as left_emulator,
        gige_camera(clock_ppm=-500.0) as right_emulator,
        connected(left_emulator, ptp=True) as left,
        connected(right_emulator, ptp=True, chunk_timestamps=True) as right,
    ):
        assert (left.identity.details["PTP"], right.identity.details["PTP"]) == ("Slave", "Slave")
        for frame in (frames_of(left, 5)[-1], frames_of(right, 5)[-1]):
            delay_s = time.time() - frame.device_time_s
            assert 0 <= delay_s < 5.0


def test_without_ptp_each_camera_has_its_own():
    with gige_camera() as emulator, connected(emulator) as camera:
        assert frames_of(camera, 1)[0].device_time_s < 1000.0
        assert read_register(emulator, 0x8028) == 0


@pytest.mark.parametrize(
    ("ptp", "error", "words"),
    [("absent", ConfigurationError, "knows no PTP"), ("never", DeviceTimeoutError, "status Listening")],
)
def test_a_camera_that_does_not_follow_is_told(ptp, error, words):
    with (
        gige_camera(ptp=ptp) as emulator,
        pytest.raises(error, match=words),
        connected(emulator, ptp=True, ptp_timeout_s=0.3),
    ):
        pass


def test_the_master_of_the_network_needs_to_follow_nobody():
    with gige_camera(ptp="master") as emulator, connected(emulator, ptp=True) as camera:
        assert camera.identity.details["PTP"] == "Master"


# ---- what is refused


@pytest.mark.parametrize(
    ("of_camera", "asked", "words"),
    [
        ({"pixel_format": "Mono16"}, {}, "sends Mono16, not Mono8"),
        ({}, {"pixel_format": "bayer_rggb8"}, "sends Mono8, not BayerRG8"),
        ({}, {"width": 320}, "sends 160x120 px, not 320x120"),
        ({}, {"fps": 30.0}, "tells 50.0 images a second, not 30"),
        ({"chunks": False}, {"chunk_timestamps": True}, "appends no time"),
    ],
)
def test_a_camera_that_is_set_otherwise_is_refused_and_left_as_it_is(of_camera, asked, words):
    with gige_camera(**of_camera) as emulator:
        with pytest.raises(ConfigurationError, match=words), connected(emulator, **asked):
            pass
        assert read_register(emulator, 0xA00) == 0, "it is still under control"


def test_nobody_at_the_address_is_told():
    with pytest.raises(DeviceUnreachableError, match="no GenICam camera 127"):
        GenICamCamera(GenICamSettings(camera=address())).connect()


def test_a_camera_under_anothers_control_is_not_taken():
    with gige_camera() as emulator, connected(emulator) as first:
        with pytest.raises(DeviceError), connected(emulator, open_timeout_s=0.5):
            pass
        assert len(frames_of(first, 3)) >= 3


@pytest.mark.parametrize(
    "wrong",
    [
        {"camera": ""},
        {"pixel_format": "bgr8"},
        {"fps": 0.0},
        {"width": 0},
        {"buffer_frames": 0},
        {"packet_size": 1501},
        {"packet_size": 100},
        {"silence_s": float("inf")},
    ],
)
def test_wrong_settings_are_refused_by_their_name(wrong):
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        GenICamSettings(**{"camera": "cam", **wrong})


def test_only_an_address_is_where_it_is_reached():
    assert DRIVER.specify(GenICamSettings(camera="192.168.0.9", fps=15.0)).host == "192.168.0.9"
    assert DRIVER.specify(GenICamSettings(camera="S42")).host == ""


# ---- faults


def test_images_that_are_lost_are_counted_and_leave_a_gap():
    with gige_camera() as emulator, connected(emulator) as camera:
        frames_of(camera, 2)
        emulator.drop(4)
        frames = frames_of(camera, 10)
        assert camera.statistics().lost == 4
    counters = [frame.counter for frame in frames]
    assert counters[-1] - counters[0] + 1 - len(counters) in (0, 4)


def test_an_image_that_lacks_a_packet_is_not_delivered():
    with gige_camera(seed=1) as emulator, connected(emulator, buffer_frames=1000) as camera:
        emulator.inject(GigEFaults(packet_loss=0.5))
        frames = frames_of(camera, 20)
        emulator.inject(GigEFaults())
        frames += frames_of(camera, 20)
        found = camera.statistics()
    assert found.malformed > 0
    assert frames[-1].counter + 1 <= len(frames) + found.malformed + found.lost + 2
    assert all((frame.image == frame.image[0, 0]).all() for frame in frames)


def test_a_camera_that_falls_silent_ends_its_stream_and_can_be_opened_again():
    with gige_camera() as emulator:
        with connected(emulator, silence_s=0.5) as camera:
            emulator.inject(GigEFaults(unplug_at_s=0.0, unplug_for_s=1.0))
            with pytest.raises(DeviceTimeoutError, match="silent"):
                while True:
                    camera.read(5.0)
        time.sleep(0.5)
        with connected(emulator) as camera:
            assert frames_of(camera, 2)


def test_a_camera_that_lost_power_is_found_again_and_counts_anew():
    with gige_camera() as emulator:
        with connected(emulator, silence_s=0.5) as camera:
            frames_of(camera, 3)
            emulator.inject(GigEFaults(restart_at_s=0.0, restart_for_s=0.2))
            with pytest.raises(DeviceTimeoutError):
                while True:
                    camera.read(5.0)
        with connected(emulator) as camera:
            assert frames_of(camera, 1)[0].counter == 0


def test_the_cameras_clock_jumps_and_its_counter_does_not():
    with gige_camera() as emulator, connected(emulator) as camera:
        before = frames_of(camera, 2)[-1]
        emulator.disturb_clock(20.0, 0.0)
        after = next(
            frame for frame in iter(lambda: frames_of(camera, 1)[-1], None) if frame.device_time_s > 15.0
        )
        frames = after.counter - before.counter
    assert after.device_time_s - before.device_time_s == pytest.approx(20.0 + frames * 0.02, abs=0.01)


# ---- numbers of images


@given(st.lists(st.integers(1, 1000), max_size=60), st.integers(1, 65535))
def test_numbers_of_16_bits_go_on_without_an_end(steps, first):
    numbers = FrameNumbers()
    assert numbers.step(first) == 0
    true = 0
    for step in steps:
        true += step
        assert numbers.step((first - 1 + true) % 65535 + 1) == step
        assert numbers.counter == true


@given(st.lists(st.integers(1, 2**40), max_size=20))
def test_numbers_of_64_bits_are_taken_as_they_are(steps):
    numbers, number = FrameNumbers(), 65536
    numbers.step(number)
    for step in steps:
        number += step
        numbers.step(number)
    assert numbers.counter == sum(steps)


# ---- the emulator


@given(st.binary(max_size=80))
def test_any_request_is_answered_or_passed_over(emulated, content):
    request = struct.pack(">BBHHH", 0x42, 1, 0x80 + 2 * (len(content) % 5), len(content), 3) + content
    emulated.sendto(request, emulated.peer)
    status, _, size, number = struct.unpack_from(">HHHH", emulated.recv(2000))
    assert (number, status == 0 or size == 0) == (3, True)


class PlainSocket(socket.socket):
    peer: tuple[str, int]


@pytest.fixture(scope="module")
def emulated():
    need_aravis()
    with gige_camera() as emulator, PlainSocket(socket.AF_INET, socket.SOCK_DGRAM) as plain:
        plain.settimeout(PATIENCE_S)
        plain.peer = (emulator.settings.host, 3956)
        yield plain


# ---- the fake camera that Aravis ships

FAKE = """
import ctypes, sys, time
library = ctypes.CDLL("libaravis-0.8.so.0")
library.arv_gv_fake_camera_new.restype = ctypes.c_void_p
library.arv_gv_fake_camera_new.argtypes = (ctypes.c_char_p, ctypes.c_char_p)
library.arv_gv_fake_camera_is_running.argtypes = (ctypes.c_void_p,)
fake = library.arv_gv_fake_camera_new(b"127.0.0.1", b"FAKE1")
print(library.arv_gv_fake_camera_is_running(fake), flush=True)
sys.stdin.read()
"""


@pytest.fixture
def fake_of_aravis():
    """Aravis' own camera; it takes no other address of this computer than 127.0.0.1."""
    with subprocess.Popen(
        [sys.executable, "-c", FAKE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            if process.stdout.readline().strip() != "1":
                pytest.skip("another GigE camera listens at 127.0.0.1")
            yield
        finally:
            process.stdin.close()


def test_the_fake_camera_of_aravis_is_read(fake_of_aravis):
    settings = GenICamSettings(camera="127.0.0.1", open_timeout_s=PATIENCE_S, silence_s=PATIENCE_S)
    with closing(GenICamCamera(settings)) as camera:
        camera.connect()
        assert (camera.identity.model, camera.identity.serial) == ("Aravis Fake", "FAKE1")
        frames = frames_of(camera, 5)
        for asked, words in (
            ({"ptp": True}, "knows no PTP"),
            ({"chunk_timestamps": True}, "appends no time"),
        ):
            camera.close()
            with (
                closing(GenICamCamera(GenICamSettings(camera="127.0.0.1", **asked))) as refused,
                pytest.raises(ConfigurationError, match=words),
            ):
                refused.connect()
    assert frames[0].image.shape == (512, 512)
    assert [frame.counter for frame in frames] == sorted({frame.counter for frame in frames})
    assert (np.diff([frame.device_time_s for frame in frames]) > 0).all()
    # its pattern moves by a grey level with each image
    assert len({frame.image.tobytes() for frame in frames}) == len(frames)
