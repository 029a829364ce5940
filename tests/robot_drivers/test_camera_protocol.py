"""What every camera does, whatever bus it is on, through the protocol alone: each on its emulator, and real ones.

A further camera joins by a context manager like :func:`stream_bench` in ``BENCHES``. With ``--hardware RIGFILE`` the
left camera of the rig file is tried as well.
"""

import time
from collections.abc import Callable
from contextlib import closing, contextmanager
from dataclasses import dataclass

import numpy as np
import pytest
from dc1394_bus import emulated_library, fresh_bus
from gige_cameras import depth_camera, gige_camera, need_aravis
from new_threads import new_threads

from robot_drivers.cameras.dc1394 import DC1394Camera, DC1394CameraSettings
from robot_drivers.cameras.emulator import CameraEmulator, CameraEmulatorSettings
from robot_drivers.cameras.opencv import OpenCVCamera
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError, DeviceTimeoutError
from robot_drivers.genicam import GenICamCamera, GenICamSettings
from robot_drivers.genicam.emulator import GigEFaults
from robot_drivers.protocols import Camera

EMBEDDED = ("timestamp", "frame_counter")
BUFFER, SILENCE_S = 5, 1.5
PATIENCE_S = 60.0


@dataclass
class Bench:
    """A camera that embeds counter and time in its images and keeps ``buffer`` of them.

    ``drop`` lets images get lost on their way, ``stall`` silences the camera, and ``resume`` ends that; only an
    emulated one can.
    """

    camera: Camera
    buffer: int | None = None
    drop: Callable[[int], object] | None = None
    stall: Callable[[], object] | None = None
    resume: Callable[[], object] | None = None


@contextmanager
def stream_bench():
    def image(time_s):
        return np.full((120, 160), round(time_s * 50) % 256, np.uint8)

    with CameraEmulator(image, CameraEmulatorSettings(width=160, height=120, fps=50.0)) as emulator:
        settings = OpenCVCameraSettings(
            emulator.url, embedded_info=EMBEDDED, buffer_frames=BUFFER, read_timeout_s=SILENCE_S
        )
        with closing(OpenCVCamera(settings)) as camera:
            yield Bench(camera, BUFFER, emulator.drop, emulator.stall, emulator.resume)


@contextmanager
def firewire_bench():
    bus = fresh_bus()
    settings = DC1394CameraSettings(
        library=emulated_library(),
        width=160,
        height=120,
        fps=50.0,
        buffer_frames=BUFFER,
        silence_s=SILENCE_S,
    )
    with closing(DC1394Camera(settings)) as camera:
        yield Bench(camera, BUFFER, bus.fake_drop, lambda: bus.fake_stall(1), lambda: bus.fake_stall(0))


@contextmanager
def gige_bench():
    need_aravis()
    with gige_camera() as emulator, gige_driver_bench(emulator, chunk_timestamps=True) as bench:
        yield bench


@contextmanager
def depth_bench():
    need_aravis()
    with depth_camera() as emulator, gige_driver_bench(emulator, depth=True) as bench:
        yield bench


@contextmanager
def gige_driver_bench(emulator, **wanted):
    settings = GenICamSettings(
        camera=emulator.settings.host,
        **wanted,
        buffer_frames=BUFFER,
        silence_s=SILENCE_S,
        open_timeout_s=PATIENCE_S,
    )
    with closing(GenICamCamera(settings)) as camera:
        yield Bench(
            camera,
            BUFFER,
            emulator.drop,
            lambda: emulator.inject(GigEFaults(stalled=True)),
            lambda: emulator.inject(GigEFaults()),
        )


BENCHES = {
    "OpenCV, stream": stream_bench,
    "FireWire": firewire_bench,
    "GenICam, GigE": gige_bench,
    "GenICam, depth": depth_bench,
}


@pytest.fixture(params=[*BENCHES, pytest.param("real", marks=pytest.mark.hardware)])
def bench(request):
    if request.param == "real":
        camera = next(iter(request.getfixturevalue("hardware")().cameras.values()))
        with closing(camera):
            yield Bench(camera)
    else:
        with BENCHES[request.param]() as bench:
            yield bench


@pytest.fixture
def camera(bench):
    bench.camera.connect()
    return bench.camera


@pytest.fixture
def faulty(bench):
    """A connected camera that can be made to misbehave."""
    if bench.drop is None:
        pytest.skip("a real camera does not misbehave on demand")
    bench.camera.connect()
    return bench


def collect(camera, count):
    frames = []
    deadline = time.monotonic() + PATIENCE_S
    while len(frames) < count and time.monotonic() < deadline:
        frames += camera.read(0.5)
    return frames


def missing(frames):
    """Images that the counters prove missing between the first frame and the last."""
    if frames[0].counter is None:
        pytest.skip("this camera does not number its images")
    return frames[-1].counter - frames[0].counter + 1 - len(frames)


def test_the_identity_says_who_the_camera_is(camera):
    identity = camera.identity
    assert identity.kind == "camera"
    assert identity.model
    assert identity.address
    assert int(identity.details["width"]) > 0
    assert int(identity.details["height"]) > 0
    assert identity == camera.identity


def test_before_connection_there_is_no_identity_but_a_remedy(bench):
    with pytest.raises(DeviceError, match="connect"):
        _ = bench.camera.identity
    assert bench.camera.statistics().received == 0


def test_a_frame_is_an_image_of_the_stated_size_and_format(camera):
    frame = collect(camera, 1)[0]
    details = camera.identity.details
    assert frame.pixel_format == details["pixel_format"]
    assert frame.image.shape[:2] == (int(details["height"]), int(details["width"]))
    assert frame.image.dtype == np.uint8
    assert frame.image.ndim == (3 if frame.pixel_format == "bgr8" else 2)


def test_depth_is_of_the_same_pixels(camera):
    frame = collect(camera, 1)[0]
    if frame.depth is None:
        assert "depth" not in camera.identity.details
        return
    assert frame.depth.counts.shape == frame.image.shape[:2]
    assert frame.depth.counts.dtype == np.uint16
    assert frame.depth.scale.scale_m > 0


def test_counters_and_clock_go_on_from_frame_to_frame(camera):
    frames = collect(camera, 10)
    assert missing(frames) >= 0
    assert (np.diff([frame.counter for frame in frames]) >= 1).all()
    steps = np.diff([frame.device_time_s for frame in frames]) / np.diff([frame.counter for frame in frames])
    assert (steps > 0).all()
    assert np.median(steps) == pytest.approx(np.mean(steps), rel=0.5)


def test_host_stamps_are_times_of_arrival(camera):
    collect(camera, 2)
    before_ns = host_time_ns()
    frames = collect(camera, 5)
    stamps = np.array([frame.host_time_ns for frame in frames])
    assert (np.diff(stamps) > 0).all()
    assert before_ns - 5_000_000_000 < stamps[0] < stamps[-1] <= host_time_ns()


def test_what_is_received_and_what_is_lost_is_every_frame_that_was_counted(camera):
    frames = collect(camera, 1)
    end = time.monotonic() + 0.5
    while time.monotonic() < end:
        frames += camera.read(0.1)
    statistics = camera.statistics()
    assert statistics.received >= len(frames)
    assert missing(frames) <= statistics.lost
    assert statistics.duplicated == statistics.restarts == statistics.malformed == 0


def test_images_lost_on_their_way_are_counted(faulty):
    frames = collect(faulty.camera, 3)
    faulty.drop(4)
    deadline = time.monotonic() + PATIENCE_S
    while missing(frames) < 4 and time.monotonic() < deadline:
        frames += collect(faulty.camera, 5)
    assert 4 <= missing(frames) <= faulty.camera.statistics().lost


def test_a_reader_that_paused_gets_the_newest_images_and_the_others_count_as_lost(faulty):
    camera = faulty.camera
    collect(camera, 1)
    received = camera.statistics().received
    deadline = time.monotonic() + PATIENCE_S
    while camera.statistics().received < received + 2 * faulty.buffer and time.monotonic() < deadline:
        time.sleep(0.01)
    frames = camera.read(0.0)
    assert len(frames) == faulty.buffer
    assert camera.statistics().lost >= faulty.buffer


def test_an_image_is_the_readers_own(camera):
    frame = collect(camera, 1)[0]
    kept = frame.image.copy()
    collect(camera, 3 * BUFFER)
    np.testing.assert_array_equal(frame.image, kept)


def test_read_returns_nothing_when_nothing_came_in_time(faulty):
    faulty.stall()
    while faulty.camera.read(0.05):
        pass
    faulty.resume()
    collect(faulty.camera, 1)
    faulty.stall()
    while faulty.camera.read(0.05):
        pass
    began = time.monotonic()
    assert faulty.camera.read(0.1) == []
    assert time.monotonic() - began > 0.09


def test_a_silent_camera_is_told_after_its_last_image(faulty):
    faulty.stall()
    with pytest.raises(DeviceTimeoutError, match="connect again"):
        collect(faulty.camera, 1000)
    with pytest.raises(DeviceTimeoutError):
        faulty.camera.read(0.0)
    faulty.resume()
    faulty.camera.close()
    faulty.camera.connect()
    assert collect(faulty.camera, 2)


def test_connecting_twice_is_an_error_and_keeps_the_stream(camera):
    with pytest.raises(DeviceError, match="already connected"):
        camera.connect()
    assert collect(camera, 2)


def test_closing_twice_and_closing_what_never_connected_is_harmless(bench):
    bench.camera.close()
    bench.camera.connect()
    bench.camera.close()
    bench.camera.close()


def test_a_closed_camera_can_be_used_again_and_counts_anew(camera):
    collect(camera, 5)
    camera.close()
    camera.connect()
    assert camera.statistics().received <= BUFFER
    assert collect(camera, 2)


def test_closing_leaves_no_thread_behind(bench):
    new = new_threads()
    bench.camera.connect()
    bench.camera.close()
    assert new() == 0
