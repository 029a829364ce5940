"""The options with which tests marked ``hardware`` meet the real devices of a rig file."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from daq.devices import Devices
from daq.rig import make_devices, read_rig

_RIG = "--hardware"
_MOTION = "--hardware-motion"


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("hardware")
    group.addoption(
        _RIG, metavar="RIGFILE", help="run the tests of the real devices that this rig file names"
    )
    group.addoption(
        _MOTION, action="store_true", help="with --hardware: also those that move the robot, by a millimetre"
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption(_RIG) is None:
        absent = pytest.mark.skip(reason=f"needs a real device: {_RIG} RIGFILE")
        for item in items:
            if item.get_closest_marker("hardware"):
                item.add_marker(absent)


@pytest.fixture
def hardware(request: pytest.FixtureRequest) -> Callable[[], Devices]:
    """What makes the real devices, not connected."""
    return partial(make_devices, read_rig(Path(request.config.getoption(_RIG))))


@pytest.fixture
def may_move(request: pytest.FixtureRequest) -> bool:
    """Whether a real robot may be moved."""
    return bool(request.config.getoption(_MOTION))
