"""The OpenCV camera against the emulator, files on disk and literal frame information."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from robot_drivers.cameras.emulator import BusClock, CameraEmulator, CameraEmulatorSettings
from robot_drivers.cameras.opencv import OpenCVCamera
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import (
    ConfigurationError,
    DeviceError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)
from robot_drivers.protocols import Camera, Frame

# a camera exposes in time however busy the machine is, and many images may wait for a reader that is not
SMALL = CameraEmulatorSettings(width=160, height=120, fps=50.0, buffered=500)
WAITING = 500
PATIENCE_S = 60.0
EMBEDDED = ("timestamp", "frame_counter")


def noise_image(time_s: float, width: int = 160, height: int = 120) -> NDArray[np.uint8]:
    """Every grey level, different at each exposure time."""
    return np.random.default_rng(round(time_s * 1e6)).integers(0, 256, (height, width), dtype=np.uint8)


@contextmanager
def connected(settings: OpenCVCameraSettings) -> Iterator[OpenCVCamera]:
    camera = OpenCVCamera(settings)
    camera.connect()
    try:
        yield camera
    finally:
        camera.close()


def collect(camera: OpenCVCamera, count: int) -> list[Frame]:
    frames: list[Frame] = []
    deadline = time.monotonic() + PATIENCE_S
    while len(frames) < count and time.monotonic() < deadline:
        frames += camera.read(timeout_s=0.5)
    return frames


def wait_until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_the_opencv_camera_is_a_camera() -> None:
    camera: Camera = OpenCVCamera(OpenCVCameraSettings("0"))
    assert camera.statistics().received == 0


@pytest.mark.parametrize("pixel_format", ["mono8", "bayer_rggb8"])
def test_raw_images_of_full_size_arrive_bit_for_bit(pixel_format: str) -> None:
    def image_source(time_s: float) -> NDArray[np.uint8]:
        return noise_image(time_s, 1288, 964)

    settings = CameraEmulatorSettings(fps=15.0)
    with (
        CameraEmulator(image_source, settings) as emulator,
        connected(
            OpenCVCameraSettings(
                emulator.url,
                pixel_format=pixel_format,
                width=1288,
                height=964,
                fps=15.0,
                embedded_info=EMBEDDED,
            )
        ) as camera,
    ):
        frames = collect(camera, 4)
    for frame in frames:
        assert frame.pixel_format == pixel_format
        assert frame.device_time_s is not None
        expected = image_source(round(frame.device_time_s * 15.0) / 15.0)
        expected[0, :8] = 0  # the information is blanked once it was read
        np.testing.assert_array_equal(frame.image, expected)


def test_counter_device_time_and_host_stamp_follow_the_exposures() -> None:
    clock = BusClock(host_time_ns(), offset_s=17.0)
    with (
        CameraEmulator(noise_image, SMALL, clock) as emulator,
        connected(
            OpenCVCameraSettings(emulator.url, embedded_info=EMBEDDED, buffer_frames=WAITING)
        ) as camera,
    ):
        frames = collect(camera, 10)
    counters = [frame.counter for frame in frames]
    times_s = np.array([frame.device_time_s for frame in frames])
    assert counters == list(range(counters[0], counters[0] + len(frames)))
    np.testing.assert_allclose(np.diff(times_s), 0.02, atol=1e-7)
    latency_s = [
        (frame.host_time_ns - clock.host_time_ns(t)) * 1e-9 for frame, t in zip(frames, times_s, strict=True)
    ]
    assert min(latency_s) > 0.0
    assert min(latency_s) < 1.0


def test_an_image_leaves_the_camera_once_it_is_read_out() -> None:
    clock = BusClock(host_time_ns())
    with (
        CameraEmulator(noise_image, replace(SMALL, readout_s=0.3), clock) as emulator,
        connected(OpenCVCameraSettings(emulator.url, embedded_info=EMBEDDED)) as camera,
    ):
        frames = collect(camera, 3)
    for frame in frames:
        assert frame.device_time_s is not None
        assert frame.host_time_ns - clock.host_time_ns(frame.device_time_s) > 0.3e9


def test_the_cycle_time_is_unwrapped_beyond_128_seconds() -> None:
    with CameraEmulator(noise_image, SMALL, BusClock(host_time_ns(), offset_s=126.0)) as emulator:
        settings = OpenCVCameraSettings(emulator.url, embedded_info=EMBEDDED, buffer_frames=WAITING)
        with connected(settings) as camera:
            times_s = np.array([frame.device_time_s for frame in collect(camera, 120)])
    assert times_s[-1] > 128.0
    np.testing.assert_allclose(np.diff(times_s), 0.02, atol=1e-7)


def test_two_cameras_of_one_bus_expose_together() -> None:
    clock = BusClock(host_time_ns(), offset_s=3.0, drift=50e-6)
    with (
        CameraEmulator(noise_image, SMALL, clock) as left_emulator,
        CameraEmulator(noise_image, SMALL, clock) as right_emulator,
        connected(OpenCVCameraSettings(left_emulator.url, embedded_info=EMBEDDED)) as left,
        connected(OpenCVCameraSettings(right_emulator.url, embedded_info=EMBEDDED)) as right,
    ):
        left_times: set[float | None] = set()
        right_times: set[float | None] = set()

        def exposed_together() -> int:
            left_times.update(frame.device_time_s for frame in left.read(0.01))
            right_times.update(frame.device_time_s for frame in right.read(0.01))
            return len(left_times & right_times)

        wait_until(lambda: exposed_together() >= 4)


def test_dropped_images_are_counted_once() -> None:
    with (
        CameraEmulator(noise_image, SMALL) as emulator,
        connected(
            OpenCVCameraSettings(emulator.url, embedded_info=EMBEDDED, buffer_frames=WAITING)
        ) as camera,
    ):
        collect(camera, 3)
        emulator.drop(4)
        wait_until(lambda: collect(camera, 5) and camera.statistics().lost > 0)
        statistics = camera.statistics()
    assert statistics.lost == 4
    assert statistics.duplicated == statistics.restarts == statistics.malformed == 0


def test_a_stall_shorter_than_the_timeout_shows_as_lost_images() -> None:
    with (
        CameraEmulator(noise_image, SMALL) as emulator,
        connected(OpenCVCameraSettings(emulator.url, embedded_info=EMBEDDED)) as camera,
    ):
        collect(camera, 2)
        emulator.stall()
        wait_until(lambda: not camera.read(timeout_s=0.1))
        emulator.resume()
        frames = collect(camera, 3)
        assert frames
        assert camera.statistics().lost >= 4


def test_a_silent_camera_is_told_after_its_last_image() -> None:
    with (
        CameraEmulator(noise_image, SMALL) as emulator,
        connected(OpenCVCameraSettings(emulator.url, read_timeout_s=1.0)) as camera,
    ):
        emulator.stall()
        assert camera.read(timeout_s=1.0)
        with pytest.raises(DeviceTimeoutError, match="silent for 1 s"):
            collect(camera, 1000)


def test_a_broken_connection_is_told_and_can_be_opened_again() -> None:
    with CameraEmulator(noise_image, SMALL) as emulator:
        camera = OpenCVCamera(OpenCVCameraSettings(emulator.url, embedded_info=EMBEDDED))
        camera.connect()
        try:
            emulator.disconnect()
            with pytest.raises(DeviceTimeoutError, match="connect again"):
                collect(camera, 1000)
            camera.close()
            camera.connect()
            assert collect(camera, 3)
        finally:
            camera.close()


def test_a_full_buffer_loses_its_oldest_images_and_counts_them() -> None:
    with (
        CameraEmulator(noise_image, SMALL) as emulator,
        connected(OpenCVCameraSettings(emulator.url, embedded_info=EMBEDDED, buffer_frames=3)) as camera,
    ):
        wait_until(lambda: camera.statistics().received >= 8)
        frames = camera.read(timeout_s=0.0)
        statistics = camera.statistics()
    assert len(frames) == 3
    assert statistics.lost >= 5
    assert frames[0].counter is not None
    assert frames[0].counter >= 5


def test_read_returns_nothing_when_nothing_came_in_time() -> None:
    with (
        CameraEmulator(noise_image, SMALL) as emulator,
        connected(OpenCVCameraSettings(emulator.url, read_timeout_s=PATIENCE_S)) as camera,
    ):
        emulator.stall()
        wait_until(lambda: not camera.read(timeout_s=0.1))
        started = time.monotonic()
        assert camera.read(timeout_s=0.1) == []
        assert time.monotonic() - started > 0.09
        emulator.resume()


def test_without_embedded_info_the_camera_tells_neither_counter_nor_time_and_no_pixel_is_blanked() -> None:
    settings = CameraEmulatorSettings(width=160, height=120, fps=50.0, frame_info=0x8000_0000)
    constant = noise_image(0.0)
    with (
        CameraEmulator(lambda _: constant, settings) as emulator,
        connected(OpenCVCameraSettings(emulator.url)) as camera,
    ):
        frame = collect(camera, 1)[0]
    assert frame.counter is None
    assert frame.device_time_s is None
    np.testing.assert_array_equal(frame.image, constant)


def test_a_camera_that_does_not_embed_its_time_is_refused() -> None:
    settings = CameraEmulatorSettings(width=160, height=120, fps=50.0, frame_info=0x8000_0000)
    white = np.full((120, 160), 255, dtype=np.uint8)
    with CameraEmulator(lambda _: white, settings) as emulator:
        camera = OpenCVCamera(OpenCVCameraSettings(emulator.url, embedded_info=EMBEDDED))
        with pytest.raises(DeviceProtocolError, match="0xffffffff, which is no bus cycle time"):
            camera.connect()


@pytest.mark.parametrize(("name", "value"), [("width", 168), ("height", 121), ("fps", 60.0)])
def test_a_camera_that_does_not_comply_is_refused(name: str, value: float) -> None:
    with CameraEmulator(noise_image, SMALL) as emulator:
        camera = OpenCVCamera(OpenCVCameraSettings(emulator.url, **{name: value}))
        with pytest.raises(ConfigurationError, match=f"{name} {value:g} was requested"):
            camera.connect()
        assert not [thread for thread in threading.enumerate() if thread.name.startswith("camera tcp")]
        with pytest.raises(DeviceError, match="not connected"):
            _ = camera.identity


def test_an_address_where_nothing_answers_is_told() -> None:
    with CameraEmulator(noise_image, SMALL) as emulator:
        url = emulator.url
    with pytest.raises(DeviceUnreachableError, match="cannot open it"):
        OpenCVCamera(OpenCVCameraSettings(url)).connect()


def test_a_missing_backend_is_told_with_the_way_out() -> None:
    if cv2.videoio_registry.hasBackend(cv2.CAP_FIREWIRE):
        pytest.skip("this OpenCV was built with FireWire")
    with pytest.raises(ConfigurationError, match="Debian's python3-opencv"):
        OpenCVCamera(OpenCVCameraSettings("0", backend="firewire")).connect()


def test_an_image_sequence_is_read_whole_and_bit_for_bit(tmp_path: Path) -> None:
    images = [noise_image(k) for k in range(30)]
    for k, image in enumerate(images):
        cv2.imwrite(str(tmp_path / f"{k:04d}.png"), image)
    settings = OpenCVCameraSettings(str(tmp_path / "%04d.png"), backend="ffmpeg", buffer_frames=4)
    with connected(settings) as camera:
        wait_until(lambda: camera.statistics().received >= 4)
        frames = collect(camera, 30)
        assert camera.statistics().lost == 0
        with pytest.raises(DeviceTimeoutError, match="ended"):
            camera.read(timeout_s=1.0)
    assert len(frames) == 30
    for frame, image in zip(frames, images, strict=True):
        np.testing.assert_array_equal(frame.image, image)


@pytest.mark.parametrize(("coding", "lossless"), [("FFV1", True), ("MJPG", False)])
def test_a_video_file_passes_as_mono_only_where_it_stores_grey_levels(
    tmp_path: Path, coding: str, lossless: bool
) -> None:
    path = tmp_path / "images.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*coding), 10.0, (160, 120), isColor=False)
    writer.write(noise_image(0.0))
    writer.release()
    camera = OpenCVCamera(OpenCVCameraSettings(str(path)))
    if lossless:
        with connected(OpenCVCameraSettings(str(path))) as camera:
            np.testing.assert_array_equal(collect(camera, 1)[0].image, noise_image(0.0))
    else:
        with pytest.raises(ConfigurationError, match="not as grey levels"):
            camera.connect()


def test_images_of_a_video_file_are_numbered_and_have_its_times(tmp_path: Path) -> None:
    path = tmp_path / "images.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"FFV1"), 10.0, (160, 120), isColor=False)
    for k in range(5):
        writer.write(noise_image(k))
    writer.release()
    with connected(OpenCVCameraSettings(str(path), buffer_frames=2)) as camera:
        frames = collect(camera, 5)
    assert [frame.counter for frame in frames] == [0, 1, 2, 3, 4]
    np.testing.assert_allclose(
        [frame.device_time_s for frame in frames], [0.0, 0.1, 0.2, 0.3, 0.4], atol=1e-6
    )


@pytest.mark.parametrize(("fps", "times_s"), [(None, [None] * 3), (25.0, [0.0, 0.04, 0.08])])
def test_an_image_sequence_has_the_times_of_the_rate_that_is_stated_and_no_others(
    tmp_path: Path, fps: float | None, times_s: list[float | None]
) -> None:
    for k in range(3):
        cv2.imwrite(str(tmp_path / f"{k:04d}.png"), noise_image(k))
    settings = OpenCVCameraSettings(str(tmp_path / "%04d.png"), pixel_format="bayer_grbg8", fps=fps)
    with connected(settings) as camera:
        frames = collect(camera, 3)
    assert [frame.counter for frame in frames] == [0, 1, 2]
    assert [frame.device_time_s for frame in frames] == times_s
    assert {frame.pixel_format for frame in frames} == {"bayer_grbg8"}
    np.testing.assert_array_equal(frames[2].image, noise_image(2))


def test_a_colour_file_is_read_as_bgr(tmp_path: Path) -> None:
    colours = np.random.default_rng(5).integers(0, 256, (120, 160, 3), dtype=np.uint8)
    cv2.imwrite(str(tmp_path / "0000.png"), colours)
    source = str(tmp_path / "%04d.png")
    with connected(OpenCVCameraSettings(source, pixel_format="bgr8")) as camera:
        np.testing.assert_array_equal(collect(camera, 1)[0].image, colours)
    with pytest.raises(DeviceError, match="mono8"):
        OpenCVCamera(OpenCVCameraSettings(source)).connect()


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"pixel_format": "mono16"}, "mono16"),
        ({"backend": "none"}, "backend"),
        ({"embedded_info": ("timestamp", "timestamp")}, "each item once"),
        ({"embedded_info": ("timestamp",), "pixel_format": "bgr8"}, "raw pixels"),
        ({"buffer_frames": 0}, "positive"),
    ],
)
def test_settings_that_cannot_be_right_are_refused(changes: dict[str, object], complaint: str) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        OpenCVCameraSettings("0", **changes)  # type: ignore[arg-type] # wrong on purpose
