"""The frame information in the first pixels: driver and emulator, each against literal bytes of the manual."""

import socket
import struct

import numpy as np
import pytest

from robot_drivers.cameras.embedded_info import (
    FrameInfo,
    FrameSequence,
    blank_frame_info,
    cycle_time_s,
    read_frame_info,
)
from robot_drivers.cameras.emulator import BusClock, CameraEmulator, CameraEmulatorSettings
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import ConfigurationError, DeviceProtocolError

SECOND_NS = 1_000_000_000

# 7 bits of seconds, 13 of cycles, 12 of offset: 1 s is 0x0200_0000, a cycle 0x1000
CYCLE_TIMES = [
    (0x0000_0000, 0.0),
    (0x0200_0000, 1.0),
    (0x0000_1000, 125e-6),
    (0x0000_0001, 1 / 24.576e6),
    (0x54FA_0600, 42 + 4000 / 8000 + 1536 / 24.576e6),
    (0xFFF3_FBFF, 128 - 1 / 24.576e6),
]


def image_starting_with(*data: int) -> np.ndarray:
    image = np.full((2, 64), 77, dtype=np.uint8)
    image[0, : len(data)] = data
    return image


@pytest.mark.parametrize(("quadlet", "seconds"), CYCLE_TIMES)
def test_a_cycle_time_is_seconds_cycles_and_offsets(quadlet: int, seconds: float) -> None:
    assert cycle_time_s(quadlet) == pytest.approx(seconds, abs=1e-9)


@pytest.mark.parametrize("quadlet", [0x01F4_0000, 0x0000_0C00, 0xFFFF_FFFF])
def test_what_cannot_be_a_cycle_time_is_refused(quadlet: int) -> None:
    with pytest.raises(DeviceProtocolError, match="no bus cycle time"):
        cycle_time_s(quadlet)


def test_items_take_four_bytes_each_in_the_order_of_the_register() -> None:
    image = image_starting_with(0x54, 0xFA, 0x06, 0x00, 1, 2, 3, 4, 0x00, 0x01, 0xE2, 0x40)
    info = read_frame_info(image, ("frame_counter", "shutter", "timestamp"))
    assert info.counter == 123456
    assert info.cycle_time_s == pytest.approx(42.5 + 62.5e-6)


def test_with_all_ten_items_on_the_counter_starts_at_byte_24() -> None:
    image = image_starting_with(*range(40))
    image[0, :4] = 0
    items = (
        *("timestamp", "gain", "shutter", "brightness", "exposure", "white_balance", "frame_counter"),
        *("strobe_pattern", "gpio_pin_state", "roi_position"),
    )
    assert read_frame_info(image, items).counter == 0x18191A1B


def test_blanking_touches_the_informed_pixels_only() -> None:
    image = image_starting_with(*range(1, 13))
    blank_frame_info(image, ("timestamp", "frame_counter"))
    assert image[0, :8].tolist() == [0] * 8
    assert image[0, 8:12].tolist() == [9, 10, 11, 12]
    assert (image[1] == 77).all()


def test_a_counter_that_wraps_loses_nothing() -> None:
    sequence = FrameSequence()
    counters = [sequence.unwrap(FrameInfo(c, None), 0)[0] for c in (0xFFFF_FFFE, 0xFFFF_FFFF, 0, 1)]
    assert counters == [0xFFFF_FFFE, 0xFFFF_FFFF, 0x1_0000_0000, 0x1_0000_0001]
    assert (sequence.lost, sequence.duplicated, sequence.restarts) == (0, 0, 0)


def test_gaps_repeats_and_restarts_of_the_counter_are_told_apart() -> None:
    sequence = FrameSequence()
    for counter in (10, 11, 15, 15, 16, 2, 3):
        sequence.unwrap(FrameInfo(counter, None), 0)
    assert (sequence.lost, sequence.duplicated, sequence.restarts) == (3, 1, 1)


def test_a_silence_of_many_wraps_is_carried_by_the_host_clock() -> None:
    sequence = FrameSequence()
    sequence.unwrap(FrameInfo(None, 100.0), 0)
    _, device_time_s = sequence.unwrap(FrameInfo(None, 30.0), 316 * SECOND_NS)
    assert device_time_s == pytest.approx(30.0 + 3 * 128.0)


@pytest.mark.parametrize(
    ("frame_info", "places"),
    [
        (0x8000_0041, {"time": 0, "counter": 4}),
        (0x8000_03FF, {"time": 0, "counter": 24}),
        (0x8000_0045, {"time": 0, "counter": 8}),
    ],
)
def test_the_emulator_writes_the_bytes_that_the_register_orders(
    frame_info: int, places: dict[str, int]
) -> None:
    settings = CameraEmulatorSettings(width=64, height=2, fps=100.0, frame_info=frame_info)
    clock = BusClock(host_time_ns(), offset_s=1000.0)
    grey = np.full((2, 64), 77, dtype=np.uint8)
    with (
        CameraEmulator(lambda _: grey, settings, clock) as emulator,
        socket.create_connection(("127.0.0.1", emulator.port), timeout=5.0) as connection,
        connection.makefile("rb") as stream,
    ):
        assert stream.readline() == b"YUV4MPEG2 W64 H2 F100:1 Ip A1:1 Cmono XCOLORRANGE=FULL\n"
        images = []
        for _ in range(3):
            assert stream.readline() == b"FRAME\n"
            images.append(stream.read(128))
    counters = [struct.unpack_from(">I", image, places["counter"])[0] for image in images]
    ticks = []
    for image in images:
        (quadlet,) = struct.unpack_from(">I", image, places["time"])
        ticks.append(((quadlet >> 25) * 8000 + (quadlet >> 12 & 0x1FFF)) * 3072 + (quadlet & 0xFFF))
    frames = np.diff(counters)  # on a busy computer some are not sent
    assert (frames >= 1).all()
    np.testing.assert_allclose(np.diff(ticks), 245_760 * frames, atol=1)
    assert 1000 % 128 <= ticks[0] / 24.576e6 < 1000 % 128 + 5
    embedded = 4 * (frame_info & 0x3FF).bit_count()
    assert set(images[0][embedded:]) == {77}


def test_an_emulator_that_cannot_embed_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="at least 40x1"):
        CameraEmulatorSettings(width=32)
