"""A calibration with motion, from the button to the session that it is in force for, through the real window."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from conftest import Operator, patient_laboratory
from scipy.spatial.transform import Rotation

from daq.frames import IDENTITY, pose
from daq.recording.folder import read_info
from daq.trajectories import Trajectory
from daq.trajectories.routines import NAMED, through
from daq.virtual_rig.launch import VirtualRig
from daq.virtual_rig.standard import calibration_settings
from gui.calibration.bench import Judged, Kept
from gui.pages.acquire import AcquirePage
from gui.pages.calibrate import CalibratePage
from robot_drivers.protocols import Speed

MEASURE_S = 0.3
BRISK = Speed(linear=0.015, angular=0.5)


@pytest.fixture(scope="module")
def laboratory(preferred: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[VirtualRig]:
    """One with nothing in the gripper."""
    with patient_laboratory(tmp_path_factory.mktemp("free air"), calibration_settings("force")) as running:
        yield running


def brief_tilts() -> Trajectory:
    axes = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    turns = Rotation.from_rotvec(math.radians(16.0) * axes)
    stops = [pose((0.0, 0.0, 0.0), turn) for turn in turns]
    return through("tare_poses", [*stops, IDENTITY], BRISK, MEASURE_S)


def test_a_motion_is_recorded_judged_accepted_and_in_force_for_the_next_session(
    at_rest: Operator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(NAMED, "tare_poses", brief_tilts)  # type: ignore[arg-type] # as a dict, which it is
    page = at_rest.window.page(CalibratePage)
    at_rest.window.show_page("Calibrate")
    page.choose("force")
    judged: list[Judged] = []
    kept: list[Kept] = []
    page.wizard.judged.connect(judged.append)
    page.wizard.kept.connect(kept.append)

    at_rest.press(page.record_button)
    messages = at_rest.window.messages
    at_rest.wait_until(lambda: bool(judged) or messages.message is not None, "an outcome")
    assert judged, messages.message
    assert judged[0].acceptable, judged[0].figures
    assert page.outcome.isVisible()
    page.outcome.accept.click()
    at_rest.wait_until(lambda: bool(kept), "a kept calibration")
    assert kept[0].path.parent == at_rest.context.sessions_folder / "calibration"
    shown = page.kinds.currentItem()
    assert shown is not None
    assert shown.text().startswith("force\nuntil 2")

    acquire = at_rest.window.page(AcquirePage)
    acquire.trial_panel.choose("pull")
    steps = {"steps": 1, "return_steps": 1, "settle_s": 0.1, "measure_s": MEASURE_S}
    acquire.trial_panel.form.set_values(steps)
    at_rest.press(acquire.start_button)
    ended = ("done", "failed", "stopped")
    at_rest.wait_until(lambda: acquire.runner.queue[-1].state in ended, "the end of a session")
    entry = acquire.runner.queue[-1]
    assert (entry.state, entry.remark) == ("done", "")
    assert entry.session is not None
    assert kept[0].path.name in read_info(entry.session).calibrations["force"]
