import numpy as np

from daq.acquisition.stereo_look import StereoLook
from daq.timing.clock_watch import ClockWatch
from robot_drivers.protocols import Frame

PERIOD_NS = 40_000_000
CAMERAS = ("left", "right")


def frame(number: int, late_ns: int = 0) -> Frame:
    return Frame(number, None, number * PERIOD_NS + late_ns, "mono8", np.full((2, 2), number, np.uint8))


def test_nothing_is_kept_until_somebody_asks() -> None:
    look = StereoLook()
    look.add("left", [frame(0)])
    look.add("right", [frame(0)])
    assert look.take(CAMERAS) == {}


def test_a_pair_is_of_one_moment_and_given_once() -> None:
    look = StereoLook()
    for camera in CAMERAS:
        look.add(camera, [frame(0)])
        look.add(camera, [frame(1)])
    look.ask()
    look.add("left", [frame(2), frame(3)])
    assert look.take(CAMERAS) == {}
    look.add("right", [frame(2, late_ns=3_000_000)])
    pair = look.take(CAMERAS)
    assert {name: found.counter for name, found in pair.items()} == {"left": 2, "right": 2}
    assert look.take(CAMERAS) == {}


def test_images_of_different_moments_are_no_pair() -> None:
    look = StereoLook()
    for camera in CAMERAS:
        look.add(camera, [frame(0)])
        look.add(camera, [frame(1)])
    look.ask()
    look.add("left", [frame(2)])
    look.add("right", [frame(4)])
    assert look.take(CAMERAS) == {}


def clock(jitter_s: float, wander_s: float) -> ClockWatch:
    """20 s of a device whose clock runs 50 ppm fast, is late by exponential delays, and wanders by a sine."""
    rng = np.random.default_rng(1)
    watch = ClockWatch()
    for tick in range(1000):
        true_s = 0.02 * tick
        late_s = rng.exponential(jitter_s) + wander_s * np.sin(0.3 * true_s)
        watch.add(100.0 + 1.00005 * true_s, round((true_s + late_s) * 1e9))
    return watch


def test_a_steady_clock_is_known_better_than_its_messages_are_late() -> None:
    assert clock(jitter_s=1e-3, wander_s=0.0).uncertainty_s() < 1e-4


def test_a_wandering_clock_is_known_to_its_wander() -> None:
    assert 5e-4 < clock(jitter_s=1e-4, wander_s=2e-3).uncertainty_s() < 4e-3


def test_a_new_clock_is_not_known() -> None:
    watch = ClockWatch()
    watch.add(1.0, 1_000_000_000)
    assert np.isnan(watch.uncertainty_s())
