"""GenICam cameras with depth: image and depth as parts of one block, and what the counts mean."""

import math
import time
from contextlib import closing, contextmanager
from dataclasses import replace

import numpy as np
import pytest
from gige_cameras import depth_camera, gige_camera, need_aravis
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.cameras.depth import depth_m
from robot_drivers.errors import ConfigurationError, DeviceProtocolError
from robot_drivers.genicam import DRIVER, GenICamCamera, GenICamSettings
from robot_drivers.genicam.emulator import GigEDepthSettings, GigEFaults
from robot_drivers.genicam.parts import INTENSITY, RANGE, Part, image_and_depth
from robot_drivers.protocols import DepthScale

PATIENCE_S = 30.0
MONO8, C16 = 0x01080001, 0x011000B8


@contextmanager
def connected(emulator, **settings):
    of_camera = GenICamSettings(
        camera=emulator.settings.host, **{"depth": True, "open_timeout_s": PATIENCE_S, **settings}
    )
    with closing(GenICamCamera(of_camera)) as camera:
        camera.connect()
        yield camera


def frames_of(camera, count):
    frames, end = [], time.monotonic() + PATIENCE_S
    while len(frames) < count:
        assert time.monotonic() < end, f"only {len(frames)} images came"
        frames += camera.read(1.0)
    return frames


@pytest.fixture
def aravis():
    need_aravis()


# ---- what it delivers


@pytest.mark.parametrize("packet_size", [None, 576, 9000])
@pytest.mark.parametrize("size", [(160, 120), (33, 17), (768, 640)])
@pytest.mark.usefixtures("aravis")
def test_image_and_depth_come_bit_for_bit_with_number_and_time(size, packet_size):
    width, height = size
    random = np.random.default_rng(3)
    image = random.integers(0, 256, (height, width), np.uint8)
    counts = random.integers(0, 65536, (height, width), np.uint16)
    with (
        depth_camera(lambda _: image, lambda _: counts, width=width, height=height, fps=20.0) as emulator,
        connected(emulator, packet_size=packet_size) as camera,
    ):
        frames = frames_of(camera, 4)
    for frame in frames:
        np.testing.assert_array_equal(frame.image, image)
        np.testing.assert_array_equal(frame.depth.counts, counts)
    steps = np.diff([frame.counter for frame in frames])
    np.testing.assert_allclose(np.diff([frame.device_time_s for frame in frames]), steps * 0.05, atol=1e-6)


@pytest.mark.parametrize("extended_ids", [False, True])
@pytest.mark.usefixtures("aravis")
def test_image_and_depth_are_of_one_exposure(extended_ids):
    with (
        depth_camera(depth=GigEDepthSettings(extended_ids=extended_ids)) as emulator,
        connected(emulator) as camera,
    ):
        for frame in frames_of(camera, 5):
            assert (frame.depth.counts - 1000) % 256 == pytest.approx(frame.image)


@pytest.mark.parametrize(
    ("told", "scale"),
    [
        ({}, DepthScale(2e-5, 0.0, 0)),
        ({"scale": 0.1, "offset": 250.0, "invalid": 65535}, DepthScale(1e-4, 0.25, 65535)),
        ({"unit": "Inch", "scale": 0.01}, DepthScale(2.54e-4, 0.0, 0)),
        ({"invalid": None, "mode": "RectifiedC"}, DepthScale(2e-5, 0.0, None)),
    ],
)
@pytest.mark.usefixtures("aravis")
def test_what_a_count_means_is_read_from_the_camera(told, scale):
    with depth_camera(depth=GigEDepthSettings(**told)) as emulator, connected(emulator) as camera:
        found = frames_of(camera, 1)[0].depth.scale
        details = camera.identity.details
    assert (found.scale_m, found.offset_m) == pytest.approx((scale.scale_m, scale.offset_m))
    assert found.invalid == scale.invalid
    assert (details["focal_length_px"], details["principal_point_px"]) == ("300", "79.5 59.5")
    assert f"{found.scale_m:g} m a count" in details["depth"]


@pytest.mark.usefixtures("aravis")
def test_a_camera_with_depth_is_one_without_where_none_is_asked_for():
    with depth_camera() as emulator, connected(emulator, depth=False) as camera:
        assert all(frame.depth is None for frame in frames_of(camera, 3))


def test_its_driver_says_that_depth_comes():
    assert DRIVER.specify(GenICamSettings(camera="192.168.0.9", depth=True)).depth
    assert not DRIVER.specify(GenICamSettings(camera="192.168.0.9")).depth


# ---- what is refused


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({"mode": "DisparityC"}, "sends DisparityC, which is no depth"),
        ({"mode": "UncalibratedC"}, "sends UncalibratedC"),
        ({"depth_format": "Coord3D_C32f"}, "sends depth as Coord3D_C32f, not Coord3D_C16"),
        ({"unit": "Pixel"}, "counts depth in Pixel"),
        ({"scale": 0.0}, "is no scale"),
        ({"scale": math.nan}, "is no scale"),
    ],
)
@pytest.mark.usefixtures("aravis")
def test_depth_that_is_none_along_the_axis_is_refused(told, words):
    with (
        depth_camera(depth=GigEDepthSettings(**told)) as emulator,
        pytest.raises(ConfigurationError, match=words) as refused,
        connected(emulator),
    ):
        pass
    assert "\n" not in str(refused.value)


@pytest.mark.usefixtures("aravis")
def test_a_camera_without_depth_is_refused():
    with (
        gige_camera() as emulator,
        pytest.raises(ConfigurationError, match="leave depth out"),
        connected(emulator),
    ):
        pass


def test_depth_goes_without_times_in_chunks():
    with pytest.raises(ConfigurationError, match="chunk_timestamps"):
        GenICamSettings(camera="cam", depth=True, chunk_timestamps=True)


# ---- faults


@pytest.mark.usefixtures("aravis")
def test_a_block_that_lacks_a_packet_is_not_delivered():
    with depth_camera() as emulator, connected(emulator, buffer_frames=1000) as camera:
        emulator.inject(GigEFaults(packet_loss=0.5))
        frames = frames_of(camera, 20)
        found = camera.statistics()
    assert found.malformed > 0
    assert all(len({*frame.image.flat}) == len({*frame.depth.counts.flat}) == 1 for frame in frames)


# ---- parts, whoever sent them


def part(component, pixel_format, size, width=4, height=3):
    return Part(component, pixel_format, width, height, size)


IMAGE, DEPTH = part(INTENSITY, MONO8, 12), part(RANGE, C16, 24)


@given(st.binary(min_size=36, max_size=40), st.permutations([IMAGE, DEPTH, part(6, 0x010800C6, 3)]))
def test_parts_are_found_in_any_order(content, parts):
    content += bytes(3)
    image, counts = image_and_depth(np.frombuffer(content, np.uint8), parts, (4, 3))
    begins = {one.component: sum(before.size for before in parts[:n]) for n, one in enumerate(parts)}
    assert image.tobytes() == content[begins[INTENSITY] :][:12]
    assert counts.astype("<u2").tobytes() == content[begins[RANGE] :][:24]


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ([IMAGE], "has 0 of the component Range"),
        ([IMAGE, DEPTH, DEPTH], "has 2 of the component Range"),
        ([], "has 0 of the component Intensity"),
        ([IMAGE, replace(DEPTH, width=5)], "5x3 px"),
        ([IMAGE, replace(DEPTH, pixel_format=MONO8)], "format 0x01080001"),
        ([IMAGE, replace(DEPTH, size=23)], "has 23 bytes"),
        ([IMAGE, part(6, 0, 10**9), DEPTH], "ends at byte 1000000036 of a block of 36"),
    ],
)
def test_parts_that_are_not_as_told_are_refused(parts, words):
    with pytest.raises(DeviceProtocolError, match=words):
        image_and_depth(np.zeros(36, np.uint8), parts, (4, 3))


# ---- counts


@given(
    st.lists(st.integers(0, 65535), min_size=1, max_size=20),
    st.floats(1e-6, 1e-3),
    st.floats(-1.0, 1.0),
    st.none() | st.integers(0, 65535),
)
def test_counts_become_metres_and_what_is_not_known_no_number(counts, scale_m, offset_m, invalid):
    found = depth_m(np.array(counts, np.uint16), DepthScale(scale_m, offset_m, invalid))
    for count, metres in zip(counts, found, strict=True):
        if count == invalid:
            assert np.isnan(metres)
        else:
            assert metres == pytest.approx(scale_m * count + offset_m, rel=1e-12, abs=1e-15)
