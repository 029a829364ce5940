"""A rig with one camera at the window: what it is offered, and its beads before anything is connected."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot
from synthetic_session import rendered_scene

from daq.acquisition.messages import Seen
from daq.calibration.of_rig import kinds_of
from daq.calibration_files.keeping import keep
from daq.calibration_files.outcome import Outcome
from daq.rig import Rig
from daq.virtual_rig.layout import Addresses, rig_description
from daq.virtual_rig.rendering.depth_scene import depth_above
from daq.virtual_rig.rendering.scene import flea2_above, flea2_pair
from gui.app import Desk
from gui.pages.acquire import AcquirePage
from gui.pages.calibrate import CalibratePage
from gui.pages.rig import RigPage
from gui.rig.bead_marks import BeadView, BeadViewer
from gui.rig.laboratory import mixed
from gui.widgets.plots.coverage_map import CoverageMap
from gui.widgets.video.camera_preview import CameraPreview
from gui.window import Window

CAMERA = flea2_above()
DEPTH_CAMERA = depth_above()
NOW = datetime(2026, 5, 4, 12, 0, tzinfo=UTC)


def rig_with(cameras: int, folder: Path) -> Rig:
    """A rig of so many cameras, one or two, whose calibration is there."""
    urls = ("tcp://a:1", "tcp://b:2")[:cameras]
    path = folder / "calibration.toml"
    (CAMERA if cameras == 1 else flea2_pair()).save(path)
    return rig_description(Addresses(1, 2, 3, 4, 5, 6, urls), path)


@pytest.fixture
def window_over(qtbot: QtBot, tmp_path: Path) -> Iterator[Callable[[Rig], Window]]:
    """Opens the window over a rig that nobody has connected."""
    with ExitStack() as stack:

        def open_window(rig: Rig) -> Window:
            desk = Desk(rig, tmp_path / "sessions")
            desk.open()
            assert desk.window is not None
            window = desk.window
            stack.callback(lambda: (desk.end(), window.deleteLater(), desk.deleteLater()))
            return window

        yield open_window


def told_on(page: RigPage | CalibratePage) -> str:
    return "\n".join(label.text() for label in page.findChildren(QLabel))


@pytest.mark.parametrize(
    ("cameras", "planar", "told"),
    [
        (1, True, "one camera, which measures beads in two dimensions"),
        (1, False, "one camera, which measures no beads: the rig file has no [planar_view]"),
        (2, False, "two cameras, a stereo pair"),
    ],
)
def test_the_window_tells_which_cameras_the_rig_has(
    window_over: Callable[[Rig], Window], tmp_path: Path, cameras: int, planar: bool, told: str
) -> None:
    rig = rig_with(cameras, tmp_path)
    window = window_over(rig if planar else replace(rig, planar_view=None))
    assert told in told_on(window.page(RigPage))
    (preview,) = window.page(AcquirePage).findChildren(CameraPreview)
    assert len(preview.panes) == cameras


def rig_with_depth(folder: Path) -> Rig:
    """A rig of one depth camera."""
    DEPTH_CAMERA.save(folder / "depth.toml")
    return rig_description(Addresses(1, 2, 3, 4, 5, 6, (), "127.0.0.9"), folder / "depth.toml")


def test_a_depth_camera_is_told_calibrated_and_shown_as_one(
    window_over: Callable[[Rig], Window], tmp_path: Path
) -> None:
    rig = rig_with_depth(tmp_path)
    window = window_over(rig)
    assert "one depth camera, which measures beads in space" in told_on(window.page(RigPage))
    page = window.page(CalibratePage)
    assert tuple(page.kinds.item(row).text() for row in range(page.kinds.count())) == kinds_of(rig)
    assert "It will not be in force" not in told_on(page)
    (preview,) = window.page(AcquirePage).findChildren(CameraPreview)
    assert len(preview.panes) == 1


def test_the_emulated_camera_of_a_rig_with_depth_has_depth(tmp_path: Path) -> None:
    own, virtual = replace(rig_with_depth(tmp_path), name="own"), rig_with_depth(tmp_path)
    mixed_rig = mixed(own, virtual, frozenset({"camera above"}))
    assert mixed_rig.depth_view == virtual.depth_view
    assert mixed_rig.with_depth == {"above"}


@pytest.mark.parametrize(("cameras", "maps"), [(1, ["above"]), (2, ["left", "right"])])
def test_the_calibrations_of_its_cameras_are_offered_and_no_others(
    window_over: Callable[[Rig], Window], tmp_path: Path, cameras: int, maps: list[str]
) -> None:
    rig = rig_with(cameras, tmp_path)
    page = window_over(rig).page(CalibratePage)
    listed = [page.kinds.item(row).text() for row in range(page.kinds.count())]
    assert tuple(listed) == kinds_of(rig)
    assert page.kind == listed[0] == ("camera" if cameras == 1 else "cameras")
    shown = page.findChildren(CoverageMap)
    assert [one.accessibleName() for one in shown] == [f"coverage of the {name} image 0%" for name in maps]
    for kind in kinds_of(rig):
        page.choose(kind)
        assert page.kind == kind
        assert page.take_button.isHidden() == (kind in ("robot", "force", "time"))


def test_a_calibration_that_nothing_will_use_is_told_before_it_is_made(
    window_over: Callable[[Rig], Window], tmp_path: Path
) -> None:
    words = "It will not be in force: the rig file has no [planar_view]"
    rig = rig_with(1, tmp_path)
    assert words not in told_on(window_over(rig).page(CalibratePage))
    assert words in told_on(window_over(replace(rig, planar_view=None)).page(CalibratePage))


def test_each_device_is_chosen_to_be_real_or_emulated(
    window_over: Callable[[Rig], Window], tmp_path: Path
) -> None:
    devices = window_over(rig_with(1, tmp_path)).page(RigPage).devices
    assert devices.emulated == frozenset()
    for chosen in ({"camera above"}, {"robot", "force sensor"}, set()):
        devices.set_emulated(frozenset(chosen))
        assert devices.emulated == chosen


# ---- beads in its live image


def seen_by(rig: Rig) -> Seen:
    """The phantom at rest."""
    image = rendered_scene(CAMERA, 0).render(np.asarray(rig.specimen.fiducials_m), 0)
    return Seen({"above": image}, "mono8", 0)


def looked_at(rig: Rig, serials: dict[str, str] | None = None) -> BeadView:
    return BeadViewer(rig, serials or {})(seen_by(rig))


def test_every_bead_in_its_image_is_named(tmp_path: Path) -> None:
    rig = rig_with(1, tmp_path)
    view = looked_at(rig)
    beads = len(rig.specimen.fiducials_m)
    assert (view.named, view.expected, view.words) == (beads, beads, "")
    (marks,) = view.marks
    assert sorted(marks.names[marks.names >= 0].tolist()) == list(range(beads))
    assert view.epipolar_px.size == 0


def test_every_bead_in_the_image_of_a_depth_camera_is_named(tmp_path: Path) -> None:
    rig = rig_with_depth(tmp_path)
    image = rendered_scene(DEPTH_CAMERA, 0).render(np.asarray(rig.specimen.fiducials_m), 0)
    view = BeadViewer(rig, {})(Seen({"above": image}, "mono8", 0))
    assert (view.named, view.words) == (len(rig.specimen.fiducials_m), "")


def test_they_are_named_by_the_calibration_in_force_and_not_by_the_rig_files(tmp_path: Path) -> None:
    rig = replace(rig_with(1, tmp_path), calibration=tmp_path / "kept")
    assert rig.planar_view is not None
    missing = replace(
        rig, planar_view=replace(rig.planar_view, calibration=tmp_path / "never calibrated.toml")
    )
    before = looked_at(missing)
    assert (before.named, before.marks) == (0, ())
    assert "never calibrated.toml" in before.words
    assert "\n" not in before.words
    outcome = Outcome("camera", CAMERA, (), lambda plot: None)
    keep(outcome, tmp_path / "kept", rig.name, {"camera above": "1"}, accepted=True, now=NOW)
    assert looked_at(missing, {"camera above": "1"}).named == len(rig.specimen.fiducials_m)
    assert looked_at(missing, {"camera above": "2"}).named == 0  # another camera than was calibrated


def test_beads_of_several_faces_are_refused_as_when_they_are_measured(tmp_path: Path) -> None:
    rig = rig_with(1, tmp_path)
    *most, (x, y, z) = rig.specimen.fiducials_m
    uneven = replace(rig.specimen, fiducials_m=(*most, (x, y, z - 0.004)))
    assert "heights that differ by 4.0 mm" in looked_at(replace(rig, specimen=uneven)).words


def test_a_camera_without_a_planar_view_marks_beads_and_says_what_names_them(tmp_path: Path) -> None:
    view = looked_at(replace(rig_with(1, tmp_path), planar_view=None))
    assert view.named == 0
    assert (view.marks[0].names < 0).all()
    assert len(view.marks[0].names) >= view.expected
    assert "[planar_view] in the rig file" in view.words


def test_marks_are_taken_away_where_nothing_is_measured_any_more(qtbot: QtBot, tmp_path: Path) -> None:
    preview = CameraPreview(["above"])
    qtbot.addWidget(preview)
    rig = rig_with(1, tmp_path)
    seen = seen_by(rig)
    preview.resize(640, 480)
    preview.show_images(seen.images)
    bare = preview.grab().toImage()
    preview.show_beads(looked_at(rig))
    assert preview.figures.text() == "16 of 16 beads recognised"
    assert preview.panes["above"].grab().toImage() != bare
    marked = preview.panes["above"].grab().toImage()
    preview.show_beads(BeadView((), (1, 1), np.empty(0), 0, 16, "calibrate the camera"))
    assert preview.panes["above"].grab().toImage() != marked
    assert preview.figures.text() == "0 of 16 beads recognised. calibrate the camera"
