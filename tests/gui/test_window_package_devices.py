"""The window over the devices of an installed package, with one camera and with four."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bench_package import install, rig_file
from conftest import operated

from daq.acquisition.messages import Seen
from daq.recording.reader import Recording
from daq.rig import read_rig
from daq.virtual_rig.layout import Addresses, rig_description
from gui.pages.acquire import AcquirePage
from gui.pages.calibrate import CalibratePage
from gui.rig.bead_marks import BeadViewer
from gui.rig.laboratory import mixed
from gui.widgets.video.camera_preview import CameraPreview

SHORT = {"steps": 1, "return_steps": 0, "settle_s": 0.1, "measure_s": 0.3}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where pip has installed the package."""
    target = tmp_path_factory.mktemp("installed")
    install(tmp_path_factory.mktemp("source") / "package", target)
    return target


@pytest.fixture
def installed(folder: Path, monkeypatch: pytest.MonkeyPatch):
    # The module stays: a process that works for the window may still answer with what the package declares.
    monkeypatch.syspath_prepend(folder)


@pytest.mark.usefixtures("installed", "qtbot")
@pytest.mark.parametrize("cameras", [1, 4])
def test_the_window_shows_and_records_them(tmp_path: Path, cameras: int) -> None:
    with operated(read_rig(rig_file(tmp_path, cameras)), tmp_path / "sessions") as operator:
        page = operator.window.page(AcquirePage)
        (preview,) = page.findChildren(CameraPreview)
        assert list(preview.panes) == [f"camera{number}" for number in range(1, cameras + 1)]
        operator.wait_until(lambda: len(operator.link.state.rows) == 2 + cameras, "a lamp for each device")
        page.trial_panel.choose("pull")
        page.trial_panel.form.set_values(SHORT)
        operator.press(page.start_button)
        operator.wait_until(lambda: operator.link.state.session is not None, "a session")
        session = operator.link.state.session
        assert session is not None
        operator.wait_until(lambda: operator.link.state.session is None, "its end")
    recording = Recording(session)
    assert recording.info.state == "sealed"
    assert len(recording.cameras) == cameras
    assert recording.robot.joints.shape[1] == 7


@pytest.mark.usefixtures("installed", "qtbot")
@pytest.mark.parametrize("cameras", [1, 2])
def test_an_image_without_a_board_is_no_view_and_says_so(tmp_path: Path, cameras: int) -> None:
    with operated(read_rig(rig_file(tmp_path, cameras)), tmp_path / "sessions") as operator:
        page, told = operator.window.page(CalibratePage), []
        page.wizard.told.connect(told.append)
        operator.press(page.take_button)
        operator.wait_until(lambda: bool(told), "an answer")
        assert told[0].startswith("not taken: no markers of DICT_4X4_100 are seen")


@pytest.mark.usefixtures("installed")
def test_beads_in_the_image_of_one_camera_are_neither_placed_nor_named(tmp_path: Path) -> None:
    viewer = BeadViewer(read_rig(rig_file(tmp_path, cameras=1)), {})
    view = viewer(Seen({"camera1": np.full((480, 640), 120, np.uint8)}, "mono8", 0))
    assert (len(view.marks), view.named) == (1, 0)
    assert "one camera measures no place in space" in view.words


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("cameras", "emulated", "names", "stereo"),
    [
        (1, {"camera camera1"}, ["camera1"], None),
        (2, {"camera camera2"}, ["camera1", "camera2"], "emulated.toml"),
        (4, {"camera camera4"}, ["camera1", "camera2", "camera3"], "stereo.toml"),
        (4, {"camera camera1", "robot"}, ["camera1", "camera2", "camera3", "camera4"], "emulated.toml"),
    ],
)
def test_an_emulated_camera_takes_the_place_of_one_of_the_pair(
    tmp_path: Path, cameras: int, emulated: set[str], names: list[str], stereo: str | None
) -> None:
    own = read_rig(rig_file(tmp_path, cameras))
    addresses = Addresses(1, 2, 3, 4, 5, 6, ("tcp://127.0.0.1:7", "tcp://127.0.0.1:8"))
    of_so_many = replace(addresses, camera_urls=addresses.camera_urls[:cameras])
    found = mixed(own, rig_description(of_so_many, tmp_path / "emulated.toml"), frozenset(emulated))
    assert [camera.name for camera in found.cameras] == names
    assert (found.stereo_calibration and found.stereo_calibration.name) == stereo


def test_a_preview_changes_to_the_cameras_of_a_recording(qtbot) -> None:
    preview = CameraPreview(["left", "right"])
    qtbot.addWidget(preview)
    preview.set_cameras(["front", "side", "above"])
    preview.show_images({"above": np.zeros((4, 4), np.uint8)})
    assert list(preview.panes) == ["front", "side", "above"]
