"""On a small or much enlarged screen the pages grow downwards: nothing has to be scrolled sideways."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest
from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QLabel, QScrollArea, QSplitter, QWidget
from pytestqt.qtbot import QtBot

from daq.rig import read_rig, write_rig
from daq.virtual_rig.layout import Addresses, rig_description
from daq.virtual_rig.rendering.scene import flea2_pair
from gui.app import Desk
from gui.pages.acquire import AcquirePage
from gui.widgets.split import BesideOrBelow, ScrolledSides
from gui.window import Window

NARROW, WIDE = 960, 1440


@pytest.fixture
def window(qtbot: QtBot, tmp_path: Path) -> Iterator[Window]:
    """The real window over a rig that nobody has connected."""
    flea2_pair().save(tmp_path / "stereo.toml")
    urls = ("tcp://127.0.0.1:7", "tcp://127.0.0.1:8")
    write_rig(
        rig_description(Addresses(1, 2, 3, 4, 5, 6, urls), tmp_path / "stereo.toml"), tmp_path / "rig.toml"
    )
    desk = Desk(read_rig(tmp_path / "rig.toml"), tmp_path / "sessions")
    desk.open()
    assert desk.window is not None
    desk.window.show()
    yield desk.window
    desk.end()
    desk.window.deleteLater()
    desk.deleteLater()


def test_no_page_scrolls_sideways_in_a_narrow_window(window: Window, qtbot: QtBot) -> None:
    for width in (NARROW, 1100, WIDE, NARROW):
        window.resize(width, 700)
        for title in window.pages:
            window.show_page(title)
            qtbot.waitUntil(lambda: not sideways(window))


def sideways(window: Window) -> list[QScrollArea]:
    """What one would have to scroll sideways."""
    areas = window.findChildren(QScrollArea)
    return [area for area in areas if area.isVisible() and area.horizontalScrollBar().maximum() > 0]


def test_planning_and_watching_are_side_by_side_where_there_is_room(window: Window, qtbot: QtBot) -> None:
    window.show_page("Acquire")
    sides = window.page(AcquirePage).findChild(ScrolledSides)
    assert isinstance(sides, QSplitter)
    for width, orientation in (
        (WIDE, Qt.Orientation.Horizontal),
        (NARROW, Qt.Orientation.Vertical),
        (WIDE, Qt.Orientation.Horizontal),
    ):
        window.resize(width, 700)
        qtbot.waitUntil(partial(is_laid_out, sides, orientation))


def is_laid_out(sides: QSplitter, orientation: Qt.Orientation) -> bool:
    return sides.orientation() == orientation


def test_a_part_goes_below_the_other_where_both_do_not_fit(qtbot: QtBot) -> None:
    left, right = part(300), part(200)
    both = BesideOrBelow(left, right, (1, 1))
    qtbot.addWidget(both)
    assert both.minimumSizeHint().width() == 300
    both.resize(QSize(600, 400))
    both.show()
    qtbot.waitUntil(lambda: right.x() > left.x() and right.y() == left.y())
    both.resize(QSize(400, 400))
    qtbot.waitUntil(lambda: right.y() > left.y() and right.x() == left.x())


def part(width: int) -> QWidget:
    made = QLabel("part")
    made.setMinimumWidth(width)
    return made
