from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from daq.virtual_rig.layout import Addresses, rig_description
from daq.vision.planar import PlanarView
from gui.app import main
from gui.opening import Opening
from gui.rig.laboratory import FORCE_SENSOR, ROBOT, mixed, roles

VIRTUAL = rig_description(Addresses(1, 2, 3, 4, 5, 6, ("tcp://a", "tcp://b")), Path("virtual.toml"))
OWN = replace(
    rig_description(Addresses(11, 12, 13, 14, 15, 16, ("tcp://c", "tcp://d")), Path("own.toml")),
    name="bench 2",
    specimen=replace(VIRTUAL.specimen, phantom_id="P07"),
)


def test_a_rig_file_that_is_not_there_is_told_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["missing.toml"]) == 2
    assert capsys.readouterr().err.startswith("retract gui: missing.toml: there is no such file")


def test_the_opening_shows_a_mistake_and_lets_choose_again(qtbot: QtBot, tmp_path: Path) -> None:
    opening = Opening()
    qtbot.addWidget(opening)
    path = tmp_path / "rig.toml"
    path.write_text('format = "something"')
    opening.read(str(path))
    assert "must be" in opening.told.text()
    with qtbot.waitSignal(opening.virtual_wanted):
        opening.virtual_button.click()
    assert not opening.file_button.isEnabled()
    opening.show_failure("the computer is too busy")
    assert opening.file_button.isEnabled()


def test_each_device_can_be_emulated_by_itself() -> None:
    rig = mixed(OWN, VIRTUAL, frozenset({FORCE_SENSOR, "camera right"}))
    assert rig.name == "bench 2 with emulated camera right, force sensor"
    assert (rig.force_sensor, rig.robot) == (VIRTUAL.force_sensor, OWN.robot)
    assert rig.cameras == (OWN.cameras[0], VIRTUAL.cameras[1])
    assert rig.specimen.phantom_id == "P07"
    assert rig.stereo_calibration == VIRTUAL.stereo_calibration


def test_an_emulated_robot_stands_in_the_emulated_laboratory() -> None:
    rig = mixed(OWN, VIRTUAL, frozenset({ROBOT}))
    assert (rig.robot, rig.force_sensor) == (VIRTUAL.robot, OWN.force_sensor)
    assert (rig.frames, rig.specimen) == (VIRTUAL.frames, VIRTUAL.specimen)


def test_without_a_rig_file_and_with_every_device_emulated_it_is_the_emulated_laboratory() -> None:
    assert mixed(None, VIRTUAL, frozenset()) is VIRTUAL
    assert mixed(OWN, VIRTUAL, frozenset(roles(OWN))) == VIRTUAL


def test_emulated_cameras_are_called_as_the_real_ones() -> None:
    names = ("above", "beside")
    cameras = tuple(replace(camera, name=name) for camera, name in zip(OWN.cameras, names, strict=True))
    own = replace(OWN, cameras=cameras)
    emulated = mixed(own, VIRTUAL, frozenset(roles(own)))
    assert roles(emulated) == roles(own)
    assert emulated.stereo_calibration == VIRTUAL.stereo_calibration


@pytest.mark.parametrize("emulated", [{"camera mine"}, {FORCE_SENSOR, ROBOT, "camera mine"}])
def test_an_emulated_only_camera_brings_its_own_planar_view(emulated: set[str]) -> None:
    virtual = rig_description(Addresses(1, 2, 3, 4, 5, 6, ("tcp://a",)), Path("virtual.toml"))
    cameras = (replace(OWN.cameras[0], name="mine"),)
    own = replace(
        OWN, cameras=cameras, stereo_calibration=None, planar_view=PlanarView(Path("own.toml"), 1e-4)
    )
    rig = mixed(own, virtual, frozenset(emulated))
    assert [camera.name for camera in rig.cameras] == ["mine"]
    assert (rig.stereo_calibration, rig.planar_view) == (None, virtual.planar_view)
    real = mixed(own, virtual, frozenset({FORCE_SENSOR}))
    assert (real.cameras, real.planar_view) == (own.cameras, own.planar_view)
