"""The body in three dimensions: what is drawn of it, and how it is turned and stepped through time."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QImage
from pytestqt.qtbot import QtBot
from synthetic_diagnoses import inclusion
from synthetic_estimates import PULL_M, block, pull_fit

from estimator.effects import blocks
from estimator.fit.result import ExperimentFit
from estimator.geometry.shapes import sphere_surface
from estimator.report.drawing.scene import farthest_row
from estimator.report.drawing.within import Kind, Shell
from gui.analysis.films import Film, film_of_fit, film_of_trace, spread
from gui.inks import ramp
from gui.theme import DARK, LIGHT, Theme
from gui.widgets.view_3d.film_player import FilmPlayer
from gui.widgets.view_3d.mesh_view import MeshView

FIT = pull_fit(noise=1.0)
KINDS: tuple[Kind, ...] = ("cavity", "region")


@pytest.fixture(scope="module")
def film() -> Film:
    return film_of_fit(block(), FIT)


@pytest.fixture
def view(qtbot: QtBot, film: Film) -> MeshView:
    made = MeshView()
    qtbot.addWidget(made)
    made.resize(420, 300)
    made.show_film(film)
    made.show()
    return made


def pixels(widget: MeshView) -> np.ndarray:
    image = widget.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    return rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).astype(int)


def test_values_at_the_beads_are_theirs_and_far_away_nothing_is_known() -> None:
    beads = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    places = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [100.0, 0.0, 0.0]])
    found = spread(np.array([[1.0, 3.0], [np.nan, 3.0], [np.nan, np.nan]]), beads, places)
    assert found[0, 0] == pytest.approx(1.0, abs=0.1)
    assert found[0, 1] == pytest.approx(2.0)
    assert found[1, :2] == pytest.approx([3.0, 3.0])
    assert np.isnan(found[0, 2])
    assert np.isnan(found[2]).all()


def test_a_film_shows_the_stretched_body_with_its_beads_where_they_were_seen(film: Film) -> None:
    row = farthest_row(FIT.experiment)
    assert len(film) == len(FIT.experiment.time)
    moved = film.points_at(row)[: len(block().points)] - 1e3 * block().points
    assert moved.max() == pytest.approx(1e3 * PULL_M)
    assert film.beads[row] == pytest.approx(1e3 * FIT.experiment.fiducials[row])
    missed = 1e3 * (FIT.experiment.fiducials[row] - FIT.fiducials[row])
    assert film.arrows[row] == pytest.approx(film.magnified * missed)
    assert film.scale is not None
    assert film.scale.unit == "µm"
    assert set(film.surface.parts) == {"tissue", "anchor", "grasp"}


def seen_without(axes: tuple[int, ...], fit: ExperimentFit = FIT) -> ExperimentFit:
    """The same fit of beads of which some coordinates were not measured; the first bead is hidden in one row."""
    seen = fit.experiment.fiducials.copy()
    seen[..., axes] = np.nan
    seen[3, 0] = np.nan
    return replace(fit, experiment=replace(fit.experiment, fiducials=seen))


def test_beads_that_one_camera_measures_are_shown_at_the_height_they_are_predicted_at() -> None:
    fit = seen_without((2,))
    film = film_of_fit(block(), fit)
    assert film.scale is not None
    shown = np.isfinite(film.beads).all(axis=2)
    assert not shown[3, 0]
    assert shown.sum() == shown.size - 1
    assert film.beads[..., :2][shown] == pytest.approx(1e3 * fit.experiment.fiducials[..., :2][shown])
    assert film.beads[..., 2][shown] == pytest.approx(1e3 * fit.fiducials[..., 2][shown])
    assert np.all(film.arrows[..., 2][shown] == 0.0)
    assert np.all(np.isfinite(film.arrows[shown]))


def test_where_no_bead_is_measured_none_is_shown() -> None:
    film = film_of_fit(block(), seen_without((0, 1, 2)))
    assert film.scale is None
    assert not np.isfinite(film.beads).any()


def test_a_diagnosis_from_one_camera_has_arrows_in_the_plane() -> None:
    trace = inclusion().traces[0]
    seen = trace.experiment.fiducials.copy()
    seen[..., 2] = np.nan
    planar = replace(trace, experiment=replace(trace.experiment, fiducials=seen))
    before, after = (film_of_trace(planar, one, None, None) for one in (trace.before, trace.after))
    assert before.scale is not None
    assert (after.scale, after.magnified) == (before.scale, before.magnified)
    assert np.isfinite(after.beads).all()
    assert np.all(after.arrows[..., 2] == 0.0)
    assert np.abs(after.arrows).max() < 0.6 * np.abs(before.arrows).max()


def test_the_body_is_drawn_in_the_colours_of_its_scale(view: MeshView, film: Film) -> None:
    drawn = {tuple(rgb) for rgb in pixels(view).reshape(-1, 3).tolist()}
    assert film.scale is not None
    known = film.values[0][np.isfinite(film.values[0]) & (film.surface.parts == "tissue")]
    assert len({tuple(rgb) for rgb in ramp(known / film.scale.top, LIGHT).tolist()} & drawn) > 3


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_more_residual_is_farther_from_the_ground_colour(theme: Theme) -> None:
    colours = ramp(np.linspace(0.0, 1.0, 9), theme).astype(int)
    apart = np.abs(colours - colours[0]).sum(axis=1)
    assert np.all(np.diff(apart[:7]) > 0)


TURNS: dict[str, tuple[Callable[[QtBot, MeshView], None], tuple[float, float]]] = {
    "right": (lambda bot, view: bot.keyClick(view, Qt.Key.Key_Right), (10.0, 0.0)),
    "up": (lambda bot, view: bot.keyClick(view, Qt.Key.Key_Up), (0.0, 10.0)),
    "drag": (lambda bot, view: drag(bot, view, QPoint(50, 0)), (-20.0, 0.0)),
}


def drag(bot: QtBot, view: MeshView, way: QPoint) -> None:
    bot.mousePress(view, Qt.MouseButton.LeftButton, pos=QPoint(100, 100))
    bot.mouseMove(view, QPoint(100, 100) + way)
    bot.mouseRelease(view, Qt.MouseButton.LeftButton, pos=QPoint(100, 100) + way)


@pytest.mark.parametrize("way", TURNS)
def test_keys_and_mouse_turn_the_body_and_home_turns_it_back(way: str, view: MeshView, qtbot: QtBot) -> None:
    turn, expected = TURNS[way]
    first, before = view.view, pixels(view)
    turn(qtbot, view)
    turned = (view.view.azimuth_deg - first.azimuth_deg, view.view.elevation_deg - first.elevation_deg)
    assert turned == pytest.approx(expected)
    assert np.any(pixels(view) != before)
    qtbot.keyClick(view, Qt.Key.Key_Home)
    assert view.view == first


def test_the_body_never_stands_on_its_head(view: MeshView, qtbot: QtBot) -> None:
    for _ in range(30):
        qtbot.keyClick(view, Qt.Key.Key_Up)
    assert view.view.elevation_deg == 90.0


def test_plus_and_minus_zoom(view: MeshView, qtbot: QtBot) -> None:
    qtbot.keyClick(view, Qt.Key.Key_Plus)
    assert view.zoom > 1.0
    qtbot.keyClick(view, Qt.Key.Key_Minus)
    assert view.zoom == pytest.approx(1.0)


def test_a_local_cause_is_drawn_in_the_body_and_carried_along_with_it(view: MeshView) -> None:
    found = inclusion()
    place = found.considered["inhomogeneity"].expected.place
    assert place is not None
    trace = found.traces[0]
    film = film_of_trace(trace, trace.before, place, blocks.INTERIOR)
    assert film.place is not None
    centres, radius = film.place
    assert radius == pytest.approx(16.1)
    row = farthest_row(trace.experiment)
    way = 1e3 * (trace.experiment.position[row] - trace.experiment.position[0])
    share = (place.centre[0] + 0.05) / 0.08
    assert centres[row] == pytest.approx(1e3 * np.array(place.centre) + share * way)
    view.show_film(film)
    with_place = pixels(view)
    view.show_film(film_of_trace(trace, trace.before, None, blocks.INTERIOR))
    assert np.any(pixels(view) != with_place)


@pytest.mark.parametrize("group", ["anchor", "grasp", "environment"])
def test_a_cause_of_a_part_of_the_body_is_hatched_there(group: blocks.Group, view: MeshView) -> None:
    trace, block = inclusion().traces[0], blocks.GROUPS[group]
    plain, marked = (film_of_trace(trace, trace.before, None, one) for one in (blocks.GROUPS["force"], block))
    assert not plain.marked.any()
    assert marked.marked.any()
    if block.pictured != "underside":
        assert set(marked.surface.parts[marked.marked]) == {block.name}
    view.show_film(plain)
    before = pixels(view)
    view.show_film(marked)
    assert np.any(pixels(view) != before)


def test_another_prediction_changes_the_arrows_and_not_their_scale() -> None:
    trace = inclusion().traces[0]
    before, after = (film_of_trace(trace, one, None, None) for one in (trace.before, trace.after))
    assert (after.scale, after.magnified) == (before.scale, before.magnified)
    assert np.nanmax(np.abs(after.arrows)) < 0.6 * np.nanmax(np.abs(before.arrows))


def test_the_slider_steps_through_time_and_playing_ends_at_the_last_instant(qtbot: QtBot, film: Film) -> None:
    player = FilmPlayer()
    qtbot.addWidget(player)
    player.show_film(film, 3)
    assert player.slider.value() == 3
    assert player.caption.text() == film.captions[3]
    player.slider.setValue(len(film) - 3)
    player.play.click()
    qtbot.waitUntil(lambda: not player.play.isChecked(), timeout=60_000)
    assert player.slider.value() == len(film) - 1
    assert player.caption.text() == film.captions[-1]


def test_without_a_film_nothing_can_be_played(qtbot: QtBot) -> None:
    player = FilmPlayer()
    qtbot.addWidget(player)
    assert not player.play.isEnabled()
    assert not player.grab().isNull()


def test_what_lies_within_the_body_shines_through_it(view: MeshView, film: Film) -> None:
    before = pixels(view)
    ball = sphere_surface(0.004, 2)
    shells = tuple(Shell(kind, kind, kind, ball) for kind in KINDS)
    apart = ([-15.0, 0.0, 0.0], [15.0, 0.0, 0.0])
    places = tuple(1e3 * ball.vertices + place for place in apart)
    view.show_film(replace(film, within=shells, within_at=lambda instant: places))
    changed = (pixels(view) != before).any(axis=2)
    columns = np.flatnonzero(changed.any(axis=0))
    # two places, with nothing between them
    assert np.diff(columns).max() > 5
    view.show_film(film)
    assert (pixels(view) == before).all()
