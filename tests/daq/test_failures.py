"""What goes wrong in the acquisition process is the same error in the program that controls it."""

import pickle
from collections.abc import Callable, Iterator

import pytest

from daq.acquisition.failures import Failure, error_of, failure_of
from daq.errors import DaqError
from daq.vision.errors import VisionError
from robot_drivers.ati.compensation.tare import TareRefusedError
from robot_drivers.errors import DeviceError, DeviceFaultError
from robot_drivers.motion.arrival import MotionInterruptedError
from robot_drivers.protocols import Pose


def kinds(base: type[Exception]) -> Iterator[type[Exception]]:
    yield base
    for below in base.__subclasses__():
        yield from kinds(below)


def across(error: Exception) -> Exception:
    """The error as it is raised at the other end of the line."""
    failure: Failure = pickle.loads(pickle.dumps(failure_of(error)))
    return error_of(failure)


class OddFaultError(DeviceFaultError):
    """An error of somebody else's driver, which wants more than a message."""

    def __init__(self, register: int, told: str) -> None:
        super().__init__(told)
        self.register = register


MADE: dict[type[Exception], Callable[[str], Exception]] = {
    MotionInterruptedError: lambda line: MotionInterruptedError(line, Pose((0.0, 0.0, 0.0))),
    OddFaultError: lambda line: OddFaultError(7, line),
}
HOUSE = [one for base in (DaqError, DeviceError) for one in kinds(base) if "test" not in one.__module__]


@pytest.mark.parametrize("kind", [*HOUSE, OddFaultError], ids=lambda one: one.__name__)
@pytest.mark.parametrize("line", ["step 3: what, where, what to do", "", "axis 5: 130.00°"])
def test_every_error_keeps_its_class_and_its_line(kind: type[Exception], line: str) -> None:
    arrived = across(MADE.get(kind, kind)(line))
    assert type(arrived) is kind
    assert str(arrived) == line


def test_errors_defined_in_rooms_of_their_own_are_among_them() -> None:
    assert {VisionError, TareRefusedError, MotionInterruptedError} < set(HOUSE)


def test_an_error_that_no_other_process_can_import_arrives_as_what_it_is_a_kind_of() -> None:
    class LocalFaultError(DeviceFaultError):
        """Of a driver that a script defines."""

    arrived = across(LocalFaultError("register 7: not there"))
    assert type(arrived) is DeviceFaultError
    assert str(arrived) == "register 7: not there"
