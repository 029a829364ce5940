"""Drivers are tried on the computer's own clock, whatever emulated laboratory other tests have left running."""

from collections.abc import Iterator

import pytest

from robot_drivers.clock import MonotonicClock, living_on


@pytest.fixture(autouse=True)
def on_the_computers_clock() -> Iterator[None]:
    with living_on(MonotonicClock()):
        yield
