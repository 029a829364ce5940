"""What whoever looks on is given: as many images as the cameras bring, up to what is worth showing."""

import numpy as np

from daq.acquisition.live_view import LiveView
from robot_drivers.protocols import Frame

FRAME_NS = 33_333_333


def frame(number: int, late_ns: int = 0) -> Frame:
    image = np.full((964, 1288), number, dtype=np.uint8)
    return Frame(number, number / 30.0, number * FRAME_NS + late_ns, "mono8", image)


def shown(live: LiveView) -> dict[str, int]:
    """The number of the newest image of each camera."""
    _, _, images = live.take()
    return {camera: int(image[0, 0]) for camera, image in images.items()}


def test_images_are_waited_for_until_every_camera_has_a_new_one() -> None:
    live = LiveView()
    for number in (1, 2):
        live.on_frames("left", [frame(number)])
        if number > 1:
            assert not live.wait_for_images(0.0)
        live.on_frames("right", [frame(number)])
        assert live.wait_for_images(0.0)
        assert shown(live) == {"left": number, "right": number}
        assert not live.wait_for_images(0.0)


def test_every_image_of_thirty_a_second_is_shown_also_where_some_come_late() -> None:
    live, seen = LiveView(), []
    for number in range(30):
        live.on_frames("left", [frame(number, late_ns=12_000_000 * (number % 2))])
        seen.append(shown(live).get("left"))
    assert seen == list(range(30))


def test_of_a_fast_camera_no_more_is_shown_than_anybody_sees() -> None:
    live, seen = LiveView(), []
    for number in range(240):
        live.on_frames("left", [Frame(number, None, number * FRAME_NS // 4, "mono8", frame(number).image)])
        seen += [*shown(live)]
    assert 50 <= len(seen) <= 110  # in two seconds
