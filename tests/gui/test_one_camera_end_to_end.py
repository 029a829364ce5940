"""A laboratory with one camera at the real window: it is calibrated, and its beads are seen and recorded by that."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import Operator, operated, patient_laboratory

from daq.progress import silent
from daq.recording.folder import read_info
from daq.recording.reader import Recording
from daq.rig import read_rig
from daq.synchronisation.experiment_rows import synchronise
from daq.virtual_rig.launch import VirtualRig
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.processes import VirtualRigSettings
from gui.calibration.bench import Judged, Kept, ViewTaken
from gui.pages.acquire import AcquirePage
from gui.pages.calibrate import CalibratePage
from gui.widgets.video.camera_preview import CameraPreview
from robot_drivers.protocols import Pose

PHANTOM = SpringPhantom(GRASP_CENTRE, placed_beads(1))
NO_MORE = 10**6
VIEWS = 14
FRESH = 3
"""Images after which one shows what was there when they were waited for."""


@pytest.fixture(scope="module")
def laboratory(preferred: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[VirtualRig]:
    settings = VirtualRigSettings(PHANTOM, seed=1, frames_per_s=4.0, cameras=1)
    with patient_laboratory(tmp_path_factory.mktemp("one camera"), settings) as running:
        yield running


@pytest.fixture(scope="module")
def operator(
    laboratory: VirtualRig, tmp_path_factory: pytest.TempPathFactory, qapp_cls: type, qapp: object
) -> Iterator[Operator]:
    """At a rig whose camera nobody has calibrated yet."""
    rig = read_rig(laboratory.rig_path)
    assert rig.planar_view is not None
    never = replace(rig.planar_view, calibration=laboratory.rig_path.with_name("never.toml"))
    with operated(replace(rig, planar_view=never), tmp_path_factory.mktemp("sessions")) as at_window:
        yield at_window


def wait_for_fresh_images(operator: Operator) -> None:
    camera = next(row for row in operator.link.state.rows if row.stream.startswith("camera"))
    assert camera.counts is not None
    wanted = camera.counts.received + FRESH

    def received() -> int:
        now = next(row for row in operator.link.state.rows if row.role == camera.role)
        return 0 if now.counts is None else now.counts.received

    operator.wait_until(lambda: received() >= wanted, "further images")


def figures_below(page: AcquirePage) -> str:
    (preview,) = page.findChildren(CameraPreview)
    return preview.figures.text()


def test_the_only_camera_is_calibrated_and_its_beads_are_measured_by_that(
    at_rest: Operator, laboratory: VirtualRig
) -> None:
    page, acquire = at_rest.window.page(CalibratePage), at_rest.window.page(AcquirePage)
    at_rest.window.show_page("Acquire")
    at_rest.wait_until(lambda: "never.toml" in figures_below(acquire), "what hinders the beads")

    at_rest.window.show_page("Calibrate")
    assert page.kind == "camera"
    taken: list[ViewTaken] = []
    judged: list[Judged] = []
    kept: list[Kept] = []
    page.wizard.view_taken.connect(taken.append)
    page.wizard.judged.connect(judged.append)
    page.wizard.kept.connect(kept.append)
    for number in range(VIEWS):
        laboratory.operator.show_board(number)
        wait_for_fresh_images(at_rest)
        at_rest.press(page.take_button)
        at_rest.wait_until(lambda number=number: len(taken) > number, "a view")  # type: ignore[misc]
        assert taken[-1].figures.problem == ""
    laboratory.operator.show_board(NO_MORE)
    at_rest.press(page.finish_button)
    at_rest.wait_until(lambda: bool(judged), "an outcome")
    assert judged[0].acceptable, judged[0].figures
    assert page.outcome.isVisible()
    page.outcome.accept.click()
    at_rest.wait_until(lambda: bool(kept), "a kept calibration")
    shown = page.kinds.currentItem()
    assert shown is not None
    assert shown.text().startswith("camera\nuntil 2")

    at_rest.window.show_page("Acquire")
    beads = len(at_rest.context.rig.specimen.fiducials_m)
    wanted = f"{beads} of {beads} beads recognised"
    at_rest.wait_until(lambda: figures_below(acquire) == wanted, "the names of all beads")

    session = recorded(at_rest, acquire)
    assert kept[0].path.name in read_info(session).calibrations["camera"]
    within = read_rig(session / "rig.toml", to_connect=False).planar_view
    assert within is not None
    assert within.calibration == session / "calibration" / kept[0].path.name
    experiment = synchronise(Recording(session), silent).experiment
    truth = np.array([PHANTOM.solve(Pose(tuple(position))).beads for position in experiment.position])
    assert np.isnan(experiment.fiducials[..., 2]).all()
    assert np.abs(experiment.fiducials[..., :2] - truth[..., :2]).max() < 2e-4


def recorded(operator: Operator, page: AcquirePage) -> Path:
    """Record a short pull, and return its folder."""
    page.trial_panel.choose("pull")
    steps = {"steps": 1, "return_steps": 1, "settle_s": 0.1, "measure_s": 0.5}
    page.trial_panel.form.set_values(steps)
    operator.press(page.start_button)
    ended = ("done", "failed", "stopped")
    operator.wait_until(lambda: page.runner.queue[-1].state in ended, "the end of a session")
    entry = page.runner.queue[-1]
    assert (entry.state, entry.remark) == ("done", "")
    assert entry.session is not None
    return entry.session
