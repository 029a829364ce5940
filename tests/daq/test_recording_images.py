import io
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from PIL import Image

from daq.errors import RecordingError
from daq.recording.folder import SessionInfo, write_info
from daq.recording.mcap import schemas
from daq.recording.mcap.log import McapLog
from daq.recording.messages import codec
from daq.recording.messages.codec import EncodedImage
from daq.recording.messages.image_encoder import MOST_WAITING, RAW_FROM_BACKLOG, ImageEncoder
from daq.recording.messages.rows import FrameRows, camera_info_row
from daq.recording.reader import Recording
from daq.recording.scanning.scan import scan
from daq.virtual_rig.rendering.scene import flea2_pair
from robot_drivers.protocols import DepthImage, DepthScale, Frame


def frame(number: int, pixel_format: str = "mono8", shape: tuple[int, ...] = (6, 8)) -> Frame:
    image = np.random.default_rng(number).integers(0, 255, shape, dtype=np.uint8)
    return Frame(number, number / 25, 10**15 + number * 40_000_000, pixel_format, image)


@pytest.mark.parametrize(
    ("pixel_format", "shape"),
    [("mono8", (5, 7)), ("bgr8", (6, 8, 3)), ("bayer_rggb8", (6, 8)), ("bayer_gbrg8", (5, 8))],
)
@pytest.mark.parametrize("store", [codec.compressed, codec.raw])
def test_images_of_every_format_come_back_bit_for_bit(
    tmp_path: Path, pixel_format: str, shape: tuple[int, ...], store: object
) -> None:
    frames = [frame(number, pixel_format, shape) for number in range(3)]
    recording = recorded(tmp_path, [store(one) for one in frames])  # type: ignore[operator]
    images = recording.images("left")
    assert images.counter.tolist() == [0, 1, 2]
    for number, original in enumerate(frames):
        np.testing.assert_array_equal(images.image(number), original.image)
        assert images.pixel_format(number) == pixel_format
        assert images.is_raw(number) == (store is codec.raw)


def recorded(folder: Path, images: list[EncodedImage]) -> Recording:
    """A session of one camera."""
    write_info(folder, SessionInfo("images", "P1", 1))
    McapLog(folder / "signals.mcap").close()
    with McapLog(folder / "cameras.mcap") as log:
        rows = FrameRows(
            log.add_channel("/camera/left/image", schemas.COMPRESSED_IMAGE),
            log.add_channel("/camera/left/image_raw", schemas.IMAGE),
            log.add_channel("/camera/left/device", schemas.DEVICE_STAMP),
            "camera_left",
        )
        for number, image in enumerate(images):
            log.append(rows.pack(image, number, backlog=number))
    return Recording(folder)


@given(
    arrays(np.uint16, st.tuples(st.integers(1, 9), st.integers(1, 9))),
    st.sampled_from([codec.compressed_depth, codec.raw_depth]),
)
def test_depth_comes_back_count_for_count(
    tmp_path_factory: pytest.TempPathFactory,
    counts: NDArray[np.uint16],
    store: Callable[[Frame], EncodedImage],
) -> None:
    original = replace(frame(0), depth=DepthImage(counts, DepthScale(1e-4)))
    depth = recorded(tmp_path_factory.mktemp("depth"), [store(original)]).images("left")
    np.testing.assert_array_equal(depth.depth(0), counts)
    assert depth.pixel_format(0) == "mono16"


def test_an_image_is_not_taken_for_depth_nor_depth_for_an_image(tmp_path: Path) -> None:
    with_depth = replace(frame(0), depth=DepthImage(np.ones((6, 8), np.uint16), DepthScale(1e-4)))
    stored = [codec.compressed(with_depth), codec.compressed_depth(with_depth)]
    found = recorded(tmp_path, stored).images("left")
    with pytest.raises(RecordingError, match="depth image 0"):
        found.depth(0)
    with pytest.raises(RecordingError, match="image 1"):
        found.image(1)


def test_depth_is_a_png_that_other_programs_read() -> None:
    counts = np.arange(60_000, 60_012, dtype=np.uint16).reshape(3, 4)
    stored = codec.compressed_depth(replace(frame(0), depth=DepthImage(counts, DepthScale(1e-4))))
    opened = Image.open(io.BytesIO(stored.data))
    np.testing.assert_array_equal(np.asarray(opened), counts)


def test_compressed_and_raw_images_are_read_in_their_order(tmp_path: Path) -> None:
    frames = [frame(number) for number in range(4)]
    stores = (codec.compressed, codec.raw, codec.raw, codec.compressed)
    images = recorded(tmp_path, [store(one) for store, one in zip(stores, frames, strict=True)]).images(
        "left"
    )
    assert [images.is_raw(number) for number in range(4)] == [False, True, True, False]
    assert images.backlog.tolist() == [0, 1, 2, 3]
    for number, original in enumerate(frames):
        np.testing.assert_array_equal(images.image(number), original.image)


def test_the_planes_of_a_mosaic_are_smaller_than_the_mosaic() -> None:
    rows, columns = np.indices((480, 640))
    smooth = 100 + 60 * np.sin(rows / 90) * np.cos(columns / 70)
    gain = np.where((rows % 2 == 0) & (columns % 2 == 0), 1.0, 0.6)
    noise = np.random.default_rng(0).normal(0.0, 1.0, smooth.shape)
    mosaic = np.rint(smooth * gain + noise).astype(np.uint8)
    as_mosaic = codec.compressed(Frame(0, 0.0, 0, "bayer_rggb8", mosaic))
    as_grey = codec.compressed(Frame(0, 0.0, 0, "mono8", mosaic))
    assert as_mosaic.data.nbytes < 0.8 * as_grey.data.nbytes


def test_a_raw_image_is_the_ros_2_message_byte_for_byte(tmp_path: Path) -> None:
    image = np.array([[1, 2, 3], [4, 5, 6]], dtype=np.uint8)
    recorded(tmp_path, [codec.raw(Frame(7, 0.0, 1_000_000_002, "mono8", image))])
    found = scan(tmp_path / "cameras.mcap")
    (record,) = found.records("/camera/left/image_raw")
    assert bytes(record[31:]) == bytes.fromhex(
        "00010000"  # encapsulation: CDR, little-endian
        "01000000 02000000"  # 1 s, 2 ns
        "0c000000 63616d6572615f6c65667400"  # "camera_left" with its NUL
        "02000000 03000000"  # height, width
        "06000000 6d6f6e6f3800"  # "mono8" with its NUL
        "00 00 03000000"  # little-endian, padding, step
        "06000000 010203040506".replace(" ", "")
    )


def test_the_cameras_intrinsics_are_recorded_as_camera_info() -> None:
    model = flea2_pair().left
    rows = camera_info_row(1, "camera_left", model, 10**15)
    body = bytes(rows.parts[0])[31:]
    # encapsulation, header, size and "plumb_bob" take 52 bytes, the length of D four, padding to eight the rest
    numbers = np.frombuffer(body, "<f8", 5 + 9 + 9 + 12, offset=60)
    np.testing.assert_array_equal(numbers[:5], model.distortion)
    np.testing.assert_array_equal(numbers[5:14], model.intrinsic_matrix.reshape(-1))


class Deliveries:
    """Collects encoded images; holds up the first of them until ``go`` is set."""

    def __init__(self) -> None:
        self.go = threading.Event()
        self.images: list[tuple[EncodedImage, int, int]] = []
        self.dropped = 0

    def deliver(self, image: EncodedImage, sequence: int, backlog: int) -> None:
        self.go.wait()
        self.images.append((image, sequence, backlog))

    def drop(self, images: int) -> None:
        self.dropped += images


def encode_behind(frames: int, disk_is_slow: bool) -> Deliveries:
    """Put so many images before the encoder whose first one is held up."""
    deliveries = Deliveries()
    encoder = ImageEncoder("left", deliveries.deliver, deliveries.drop, lambda: disk_is_slow)
    encoder.put([frame(number) for number in range(frames)])
    deliveries.go.set()
    encoder.close()
    return deliveries


def test_an_encoder_that_falls_behind_passes_images_on_raw_until_it_has_caught_up() -> None:
    images = encode_behind(12, disk_is_slow=False).images
    assert [sequence for _, sequence, _ in images] == list(range(12))
    for image, _, backlog in images:
        assert (image.compression is None) == (backlog >= RAW_FROM_BACKLOG)
    assert images[-1][0].compression is not None
    assert sum(image.compression is None for image, _, _ in images) >= 12 - RAW_FROM_BACKLOG - 2


def test_raw_images_are_no_way_out_when_the_disk_is_slow() -> None:
    images = encode_behind(12, disk_is_slow=True).images
    assert all(image.compression is not None for image, _, _ in images)


def test_images_beyond_the_bound_of_the_queue_are_dropped_and_counted() -> None:
    deliveries = encode_behind(MOST_WAITING + 20, disk_is_slow=False)
    assert deliveries.dropped in (19, 20)
    assert len(deliveries.images) + deliveries.dropped == MOST_WAITING + 20
