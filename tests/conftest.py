"""How the tests share a machine, and the options with which those marked ``hardware`` meet a rig file's devices."""

import ctypes
import gc
import os
import re
import signal
import sys
from collections.abc import Callable, Generator
from functools import cache, partial
from pathlib import Path

import hypothesis
import pytest
from hypothesis.internal.conjecture import providers
from xdist import is_xdist_worker
from xdist.scheduler import LoadScopeScheduling
from xdist.workermanage import WorkerController

from daq.devices import Devices
from daq.rig import make_devices, read_rig
from robot_drivers.real_time import give_way

_RIG = "--hardware"
_MOTION = "--hardware-motion"

# Modules that only compute. All others may run emulated devices, which live in real time, or look at a clock: they wait
# more than they compute.
_COMPUTING = re.compile(
    r"tests/(estimator/"
    r"|daq/test_(bad_input|calibration|cli_(benchmark|budget|calibrate|diagnose|estimate|handover|phantom|simulate|study)"
    r"|export_|importing_|investigation|planned_experiment|recording_(damage|rewritten)|running_sync|session_report|sync|timing"
    r"|uncertainties|view_names|vision_)"
    r"|test_(architecture|docs_|platforms|requirements_lock|trust))"
)
_STEPS_BACK = 5  # of niceness: a quarter of a processor that the laboratory wants too

# Of those that compute, the ones with tests of several seconds: they begin early, so that none is left over at the end.
_LONG = re.compile(
    r"tests/(estimator/test_(diagnosis_(case|local_resolution)|effects_foreign_forms|examples|fit_(coverage|estimation)"
    r"|handover_|published_gap|report_estimation)"
    r"|daq/test_(cli_calibrate|running_sync|session_report)|test_docs_site)"
)

# Modules in real time are dealt out in two sets that take about as long; those of a set follow each other.
_DRIVERS_AND_WINDOW = re.compile(r"tests/(robot_drivers/|gui/|test_ending_together)")
_IN_REAL_TIME = _DRIVERS, _SESSIONS = "drivers and window", "sessions and commands"

# One thread in the linear algebra of each worker and of all that it starts: there are more of them than processors, and
# threads that wait for each other keep a processor busy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# The same examples at every run, however busy the machine. Hypothesis would also try constants that it finds in those
# modules of the project that are imported by then, which depends on the tests that the process was given before.
pytest.MonkeyPatch().setattr(providers, "_get_local_constants", providers.Constants)
hypothesis.settings.register_profile(
    "repeatable",
    deadline=None,
    derandomize=True,
    suppress_health_check=[hypothesis.HealthCheck.too_slow],
)
hypothesis.settings.load_profile("repeatable")

# A job in the background of a shell starts with Ctrl-C ignored, one that is to outlive its terminal with that ignored,
# and what they start inherits it; the tests that end programs so would wait for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


class Laboratories(LoadScopeScheduling):
    """Deals modules that compute out one by one; the rest goes to two workers, each in the order of a single process.

    What lives in real time waits for half of its time, so that two such workers leave a third to the one that computes.
    """

    def _split_scope(self, nodeid: str) -> str:
        if _COMPUTING.match(nodeid):
            return nodeid.partition("::")[0]
        return _DRIVERS if _DRIVERS_AND_WINDOW.match(nodeid) else _SESSIONS

    def _assign_work_unit(self, node: WorkerController) -> None:
        """Hand out what lives in real time, then what takes long, then the modules with most tests first."""
        first = min(self.workqueue, key=lambda scope: (scope not in _IN_REAL_TIME, not _LONG.match(scope)))
        self.workqueue.move_to_end(first, last=False)
        super()._assign_work_unit(node)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> Laboratories:
    return Laboratories(config, log)


def pytest_runtest_setup(item: pytest.Item) -> None:
    if is_xdist_worker(item.session) and _COMPUTING.match(item.nodeid):
        _step_back()


@cache
def _step_back() -> None:
    """Let this process come second to the laboratories of other workers, from now on."""
    give_way(_STEPS_BACK)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(nextitem: pytest.Item | None, item: pytest.Item) -> Generator[None, None, None]:
    """Give back to the system, after each module, what its tests have freed: the C library would keep most of it."""
    yield
    if nextitem is None or nextitem.path != item.path:
        _return_freed_memory()


def _return_freed_memory() -> None:
    if sys.platform == "linux" and hasattr(libc := ctypes.CDLL(None), "malloc_trim"):  # of glibc alone
        libc.malloc_trim(0)


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


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What is imported and collected stays to the end: nothing of it need be gone through again and again."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture
def hardware(request: pytest.FixtureRequest) -> Callable[[], Devices]:
    """What makes the real devices, not connected."""
    return partial(make_devices, read_rig(Path(request.config.getoption(_RIG))))


@pytest.fixture
def may_move(request: pytest.FixtureRequest) -> bool:
    """Whether a real robot may be moved."""
    return bool(request.config.getoption(_MOTION))
