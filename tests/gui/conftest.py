import gc
import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from PySide6.QtWidgets import QAbstractButton

# another platform, such as xcb under Xvfb, may be asked for from outside
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from pytestqt.qtbot import QtBot

from daq.devices import connected
from daq.rig import Rig, make_devices, read_rig, write_rig
from daq.virtual_rig.launch import VirtualRig, virtual_rig
from daq.virtual_rig.layout import GRASP_CENTRE, Addresses, placed_beads, rig_description
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.processes import VirtualRigSettings
from daq.virtual_rig.rendering.scene import flea2_pair
from gui.app import Desk
from gui.context import Context, Navigator
from gui.jobs.running import Jobs
from gui.pages.acquire import AcquirePage
from gui.pages.rig import RigPage
from gui.rehearsal import wait_until
from gui.rig.link import AcquisitionLink
from gui.window import Window
from robot_drivers.abb.egm.position_stream import EGMSettings
from robot_drivers.abb.irb140.session import IRB140Settings
from robot_drivers.real_time import prefer_this_process

HERE = Path(__file__).parent

PATIENCE_S = 15.0
"""Emulated devices on a busy machine may keep silent for some seconds, which is not what these tests are about."""

NO_MORE = 10**6
"""After the last touch the emulated person jogs the robot back to rest."""


@pytest.fixture(scope="session")
def loaded_once() -> None:
    """What has been imported stays, and need not be gone through by each collection."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def collected_on_this_thread(loaded_once: None) -> Iterator[None]:
    """Widgets of tests gone by end on this thread, for the reason that :mod:`gui.collector` tells."""
    were_on = gc.isenabled()
    gc.disable()
    yield
    gc.collect()
    if were_on:
        gc.enable()


@pytest.fixture(scope="module")
def preferred() -> Iterator[None]:
    """This process and what it starts go before others, as the window does, where the system grants it."""
    before = os.getpriority(os.PRIO_PROCESS, 0)
    granted = prefer_this_process()
    yield
    if granted:
        os.setpriority(os.PRIO_PROCESS, 0, before)


@contextmanager
def patient_laboratory(folder: Path, settings: VirtualRigSettings) -> Iterator[VirtualRig]:
    """Emulated devices in processes of their own."""
    with virtual_rig(folder, settings) as running:
        rig = read_rig(running.rig_path)
        patient = replace(
            rig,
            limits=replace(rig.limits, communication_age_s=PATIENCE_S),
            robot=replace(rig.robot, settings=replace(rig.robot.settings, silence_limit_s=PATIENCE_S)),
        )
        write_rig(patient, running.rig_path)
        yield running


@dataclass
class Shared:
    """The laboratory of all tests of the window, while it runs."""

    until_elsewhere: ExitStack
    running: VirtualRig | None = None


_SHARED = pytest.StashKey[Shared]()


@pytest.fixture(scope="module")
def laboratory(
    preferred: None, pytestconfig: pytest.Config, tmp_path_factory: pytest.TempPathFactory
) -> VirtualRig:
    """One laboratory for all; it outlives every window, and not the tests of this folder."""
    shared = pytestconfig.stash.setdefault(_SHARED, Shared(ExitStack()))
    if shared.running is None:
        settings = VirtualRigSettings(SpringPhantom(GRASP_CENTRE, placed_beads(1)), seed=1, frames_per_s=4.0)
        folder = tmp_path_factory.mktemp("laboratory")
        shared.running = shared.until_elsewhere.enter_context(patient_laboratory(folder, settings))
    return shared.running


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
    """End the laboratory behind the last test of this folder: it would keep a processor busy beside all others.

    The scope "package" does not: where a folder has no ``__init__.py`` it is the whole session.
    """
    try:
        yield
    finally:
        shared = item.config.stash.get(_SHARED, None)
        if shared is not None and (nextitem is None or not nextitem.path.is_relative_to(HERE)):
            shared.running = None
            shared.until_elsewhere.close()


@pytest.fixture
def rig_path(laboratory: VirtualRig) -> Iterator[Path]:
    """The rig file; its robot released and at rest. Whoever connected to it has let go of it when the test ends."""
    rig = read_rig(laboratory.rig_path)
    with connected(make_devices(rig)) as devices:
        devices.robot.resume()
    laboratory.operator.touch_point(NO_MORE)
    yield laboratory.rig_path
    settings = rig.robot.settings
    assert isinstance(settings, IRB140Settings)
    deadline = time.monotonic() + 30.0
    while not is_free(settings.egm) and time.monotonic() < deadline:
        time.sleep(0.05)


def is_free(egm: EGMSettings) -> bool:
    """Tell whether nobody listens where the robot streams its poses to."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((egm.bind_address, egm.port))
        except OSError:
            return False
    return True


class Operator:
    """Who sits at the real window, with its devices connected."""

    def __init__(self, desk: Desk) -> None:
        assert desk.window is not None
        assert desk.context is not None
        self.window: Window = desk.window
        self.context: Context = desk.context

    @property
    def link(self) -> AcquisitionLink:
        return self.context.link

    def wait_until(self, condition: Callable[[], bool], what: str) -> None:
        wait_until(condition, what, 240.0)

    def press(self, button: QAbstractButton) -> None:
        """Click a button as soon as it can be: while the rig is busy it cannot."""
        self.wait_until(button.isEnabled, f'an enabled button "{button.text()}"')
        button.click()

    def begin_slow_pull(self) -> Path:
        """Record a pull that would take long, and return its folder once the robot moves."""
        page = self.window.page(AcquirePage)
        page.trial_panel.choose("pull")
        slow = {"steps": 1, "step_length_m": 0.006, "return_steps": 0, "speed_m_s": 0.0005}
        page.trial_panel.form.set_values(slow)
        self.press(page.start_button)
        self.wait_until(lambda: self.link.state.step >= 1, "the first step")
        folder = self.link.state.session
        assert folder is not None
        return folder


@contextmanager
def operated(rig: Rig, sessions: Path) -> Iterator[Operator]:
    desk = Desk(rig, sessions)
    desk.open()
    operator = Operator(desk)
    operator.window.page(RigPage).connect_button.click()
    operator.wait_until(lambda: operator.link.state.tool is not None, "a connected rig that tells its state")
    yield operator
    desk.end()
    operator.window.deleteLater()
    desk.deleteLater()


@pytest.fixture(scope="module")
def operator(
    laboratory: VirtualRig, tmp_path_factory: pytest.TempPathFactory, qapp_cls: type, qapp: object
) -> Iterator[Operator]:
    with operated(read_rig(laboratory.rig_path), tmp_path_factory.mktemp("sessions")) as at_window:
        yield at_window


@pytest.fixture
def at_rest(operator: Operator, laboratory: VirtualRig, qtbot: QtBot) -> Operator:
    """The operator with a robot that may move and stands at the grasp."""
    bring_to_rest(operator, laboratory)
    return operator


def bring_to_rest(operator: Operator, laboratory: VirtualRig) -> None:
    """Release the robot and have the emulated person jog it to the grasp."""
    if operator.link.state.held:
        operator.window.rig_bar.release.click()
    laboratory.operator.touch_point(NO_MORE)
    while operator.window.messages.message is not None:
        operator.window.messages.dismiss()
    operator.wait_until(lambda: operator.link.state.phase == "ready", "a released robot")


@pytest.fixture
def context(tmp_path: Path, qtbot: QtBot) -> Iterator[Context]:
    """What a page is given; no device is connected."""
    flea2_pair().save(tmp_path / "stereo.toml")
    addresses = Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2"))
    rig = rig_description(addresses, tmp_path / "stereo.toml")
    made = Context(rig, tmp_path / "sessions", AcquisitionLink(rig), Jobs(), Navigator())
    yield made
    made.jobs.close()
    made.link.end()
