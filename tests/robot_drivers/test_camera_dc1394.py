"""The FireWire driver: layouts of libdc1394's structures, and the driver on an emulated bus."""

import ctypes
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest
from dc1394_bus import emulated_library, fresh_bus
from new_threads import new_threads

from robot_drivers.cameras import dc1394_library as lib
from robot_drivers.cameras.dc1394 import DC1394Camera, DC1394CameraSettings
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import (
    ConfigurationError,
    DeviceError,
    DeviceFaultError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)


def settings_for(**changes):
    basic = {"library": emulated_library(), "width": 160, "height": 120, "fps": 50.0, "shutter_s": 0.005}
    return DC1394CameraSettings(**basic | changes)


@pytest.fixture
def bus():
    bus = fresh_bus()
    yield bus
    assert bus.fake_open() == 0  # every camera was given back


@contextmanager
def connected(**changes):
    camera = DC1394Camera(settings_for(**changes))
    camera.connect()
    try:
        yield camera
    finally:
        camera.close()


def collect(camera, count):
    frames = []
    deadline = time.monotonic() + 5.0
    while len(frames) < count and time.monotonic() < deadline:
        frames += camera.read(0.5)
    return frames


# ---- layouts, as gcc gives them for the headers of libdc1394 2.2.6 on x86-64


@pytest.mark.skipif(sys.maxsize < 2**32, reason="offsets of 64-bit systems")
@pytest.mark.parametrize(
    ("structure", "offsets"),
    [
        (lib.CameraId, {"unit": 0, "guid": 8}),
        (lib.CameraList, {"num": 0, "ids": 8}),
        (
            lib.CameraStruct,
            {
                "guid": 0,
                "unit": 8,
                "command_registers_base": 24,
                "advanced_features_csr": 40,
                "format7_csr": 72,
                "iidc_version": 136,
                "vendor": 144,
                "model": 152,
                "vendor_id": 160,
                "bmode_capable": 168,
            },
        ),
        (
            lib.VideoFrame,
            {
                "image": 0,
                "size": 8,
                "color_coding": 24,
                "color_filter": 28,
                "stride": 40,
                "video_mode": 44,
                "total_bytes": 48,
                "image_bytes": 56,
                "packet_size": 64,
                "packets_per_frame": 68,
                "timestamp": 72,
                "frames_behind": 80,
                "camera": 88,
                "id": 96,
                "allocated_image_bytes": 104,
                "little_endian": 112,
                "data_in_padding": 116,
            },
        ),
    ],
)
def test_structures_are_laid_out_as_in_the_headers(structure, offsets):
    assert {name: getattr(structure, name).offset for name in offsets} == offsets


def test_structures_have_the_size_of_the_headers():
    assert ctypes.sizeof(lib.VideoFrame) == 120
    assert ctypes.sizeof(lib.CameraId) == ctypes.sizeof(lib.CameraList) == 16


# ---- driver


def test_images_arrive_untouched_with_counter_bus_time_and_receive_stamp(bus):
    with connected() as camera:
        before_ns = host_time_ns()
        frames = collect(camera, 10)
        statistics = camera.statistics()
    y, x = np.mgrid[:120, :160]
    for frame in frames:
        expected = ((x + 3 * y + frame.counter) & 0xFF).astype(np.uint8)
        expected[0, :8] = 0  # the information is blanked once it was read
        np.testing.assert_array_equal(frame.image, expected)
    counters = [frame.counter for frame in frames]
    assert counters == list(range(counters[0], counters[0] + len(frames)))
    times = np.array([frame.device_time_s for frame in frames])
    assert np.median(np.diff(times)) == pytest.approx(0.02, abs=0.01)
    assert before_ns - 1_000_000_000 < frames[0].host_time_ns < frames[-1].host_time_ns <= host_time_ns()
    assert statistics.lost == statistics.duplicated == statistics.malformed == 0


def test_the_identity_is_the_cameras(bus):
    with connected(fps=25.0) as camera:
        identity = camera.identity
    assert identity.model == "Point Grey Research Flea2G FL2G-13S2C"
    assert identity.serial == "00b09d0100a1b2c0"
    assert identity.details == {
        "width": "160",
        "height": "120",
        "fps": "25",
        "pixel_format": "mono8",
        "shutter": "0.005 s",
    }


def test_the_whole_sensor_is_taken_where_no_region_is_named(bus):
    with connected(width=None, height=None, fps=15.0) as camera:
        assert collect(camera, 1)[0].image.shape == (964, 1288)


def test_bus_time_and_host_time_are_read_together(bus):
    with connected() as camera:
        frames = collect(camera, 3)
        bus_time = camera.bus_time()
        now_ns = host_time_ns()
    assert abs(now_ns - bus_time.host_time_ns) < 50_000_000
    age_s = (bus_time.cycle_time_s - frames[-1].device_time_s) % 128
    assert age_s == pytest.approx((bus_time.host_time_ns - frames[-1].host_time_ns) * 1e-9, abs=0.05)


def test_each_camera_of_a_pair_is_found_by_its_number(bus):
    bus.fake_cameras(2)
    with connected(guid="00b09d0100a1b2c0") as left, connected(guid="00B09D0100A1B2C1") as right:
        assert left.identity.serial == "00b09d0100a1b2c0"
        assert right.identity.serial == "00b09d0100a1b2c1"
        assert collect(left, 3)
        assert collect(right, 3)
    with pytest.raises(ConfigurationError, match=r"several .*00b09d0100a1b2c0, 00b09d0100a1b2c1"):
        DC1394Camera(settings_for()).connect()


@pytest.mark.parametrize(
    ("colour_filter", "pixel_format"),
    [(512, "bayer_rggb8"), (513, "bayer_gbrg8"), (514, "bayer_grbg8"), (515, "bayer_bggr8")],
)
def test_a_mosaic_comes_raw_under_its_own_name_only(bus, colour_filter, pixel_format):
    bus.fake_color_filter(colour_filter)
    with connected(pixel_format=pixel_format) as camera:
        assert collect(camera, 1)[0].pixel_format == pixel_format
    other = "bayer_bggr8" if pixel_format == "bayer_rggb8" else "bayer_rggb8"
    with pytest.raises(ConfigurationError, match=f"has the mosaic {pixel_format}, not {other}"):
        DC1394Camera(settings_for(pixel_format=other)).connect()


def test_images_that_never_came_are_counted_by_the_cameras_own_counter(bus):
    with connected() as camera:
        collect(camera, 2)
        bus.fake_drop(3)
        collect(camera, 5)
        assert camera.statistics().lost == 3


def test_damaged_images_are_counted_and_not_delivered(bus):
    with connected() as camera:
        collect(camera, 2)
        bus.fake_corrupt(2)
        frames = collect(camera, 4)
        statistics = camera.statistics()
    assert statistics.malformed == 2
    assert statistics.lost == 2
    assert len({frame.counter for frame in frames}) == len(frames)


def test_a_silent_camera_is_told_after_its_last_image(bus):
    with connected(silence_s=0.3) as camera:
        bus.fake_stall(1)
        with pytest.raises(DeviceTimeoutError, match=r"no image for 0\.3 s"):
            collect(camera, 1000)


def test_a_camera_that_never_sends_is_told_on_connection(bus):
    bus.fake_stall(1)
    with pytest.raises(DeviceTimeoutError, match="trigger and bandwidth"):
        DC1394Camera(settings_for(silence_s=0.2)).connect()


def test_an_unplugged_camera_is_told_in_the_librarys_words_and_can_be_used_again(bus):
    camera = DC1394Camera(settings_for())
    camera.connect()
    bus.fake_unplug(1)
    with pytest.raises(DeviceFaultError, match="dc1394_capture_dequeue: IOCTL failure"):
        collect(camera, 1000)
    camera.close()
    bus.fake_unplug(0)
    camera.connect()
    assert collect(camera, 2)
    camera.close()


def test_a_stamp_that_is_not_the_buss_time_is_refused(bus):
    bus.fake_stamp_offset_ms(-30_000)
    with pytest.raises(DeviceProtocolError, match=r"claims to be 30\.\d+ s old"):
        DC1394Camera(settings_for()).connect()


def test_a_camera_that_cannot_embed_what_is_asked_is_refused(bus):
    bus.fake_embeds(0x01)
    with pytest.raises(ConfigurationError, match="does not embed"):
        DC1394Camera(settings_for()).connect()
    with connected(embedded_info=("timestamp",)) as camera:
        frame = collect(camera, 1)[0]
    assert frame.counter is None
    assert frame.device_time_s is not None


def test_without_embedded_info_no_pixel_is_blanked(bus):
    with connected(embedded_info=()) as camera:
        frame = collect(camera, 1)[0]
    assert (frame.counter, frame.device_time_s) == (None, None)
    assert (np.diff(frame.image[0].astype(int)) % 256 == 1).all()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"fps": 200.0}, "stays at 120"),
        ({"width": None, "height": None, "fps": 60.0}, r"need packets of 9316 bytes, it can send 8192"),
        ({"guid": "00b09d0100a1b2ff"}, r"those there: 00b09d0100a1b2c0"),
    ],
)
def test_what_the_camera_or_the_bus_cannot_do_is_refused(bus, changes, words):
    with pytest.raises((ConfigurationError, DeviceUnreachableError), match=words):
        DC1394Camera(settings_for(**changes)).connect()


def test_a_region_beyond_the_sensor_is_told_in_the_librarys_words(bus):
    with pytest.raises(DeviceFaultError, match="dc1394_format7_set_roi: Invalid argument value"):
        DC1394Camera(settings_for(left=1200)).connect()


def test_no_bus_and_no_camera_are_told(bus):
    bus.fake_cameras(0)
    with pytest.raises(DeviceUnreachableError, match="those there: none"):
        DC1394Camera(settings_for()).connect()
    bus.fake_cameras(-1)
    with pytest.raises(DeviceUnreachableError, match="/dev/fw"):
        DC1394Camera(settings_for()).connect()


def test_closing_ends_the_thread_and_reading_before_connection_waits_for_nothing(bus):
    new = new_threads()
    with connected():
        assert new() == 1
    assert new() == 0
    with pytest.raises(DeviceError, match="connect"):
        _ = DC1394Camera(settings_for()).identity


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"guid": "b09d"}, "16 hexadecimal digits"),
        ({"pixel_format": "bgr8"}, "bgr8"),
        ({"embedded_info": ("timestamp", "timestamp")}, "each item once"),
        ({"iso_speed": 1600}, "iso_speed"),
        ({"fps": 0.0}, "fps"),
        ({"left": -1}, "negative"),
        ({"width": 4}, "too narrow"),
    ],
)
def test_settings_that_cannot_be_right_are_refused(changes, words):
    with pytest.raises(ConfigurationError, match=words):
        DC1394CameraSettings(**changes)
