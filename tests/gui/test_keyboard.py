"""Everything that the mouse can do, the keyboard can: every page is walked through with Tab."""

from collections.abc import Iterator

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QScrollBar,
    QWidget,
)

from daq.virtual_rig.layout import Addresses, rig_description
from daq.virtual_rig.rendering.scene import flea2_pair
from gui.app import Desk
from gui.rehearsal import wait_until
from gui.widgets.forms.retraction_card import RetractionCard
from gui.widgets.tables import ReadTable
from gui.window import Window

PAGES = ("Rig", "Calibrate", "Acquire", "Estimate", "Diagnose", "Sessions")
OPERABLE = (QAbstractButton, QAbstractItemView, QAbstractSlider, QAbstractSpinBox, QComboBox, QLineEdit)
MOST_STEPS = 300


@pytest.fixture(scope="module")
def window(qapp: QApplication, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Window]:
    """The window of a rig that is not connected."""
    folder = tmp_path_factory.mktemp("bench")
    flea2_pair().save(folder / "stereo.toml")
    addresses = Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2"))
    desk = Desk(rig_description(addresses, folder / "stereo.toml"), folder / "sessions")
    desk.open()
    assert desk.window is not None
    desk.window.activateWindow()
    wait_until(desk.window.isActiveWindow, "an active window")
    yield desk.window
    desk.end()
    desk.window.deleteLater()


def operable(page: QWidget) -> set[QWidget]:
    """Return what on a page takes a click or a text now, but for the parts of others."""
    found = {widget for kind in OPERABLE for widget in page.findChildren(kind)}
    return {
        widget
        for widget in found
        if widget.isVisible()
        and widget.isEnabled()
        and not isinstance(widget, QScrollBar)
        and not isinstance(widget.parentWidget(), QAbstractSpinBox | QComboBox | QAbstractItemView)
        and widget.objectName() not in ("qt_spinbox_lineedit", "qt_tableview_cornerbutton")
        and not (isinstance(widget, QAbstractButton) and is_part_of_view(widget))
    }


def is_part_of_view(widget: QWidget) -> bool:
    parent = widget.parentWidget()
    return parent is not None and (isinstance(parent, QAbstractItemView) or is_part_of_view(parent))


def walked(window: Window) -> list[QWidget]:
    """Return where Tab leads from the list of the pages until it is there again."""
    window.navigation.setFocus()
    steps: list[QWidget] = []
    for _ in range(MOST_STEPS):
        at = QApplication.focusWidget()
        assert at is not None
        if steps and at is steps[0]:
            return steps
        steps.append(at)
        QTest.keyClick(at, Qt.Key.Key_Tab)
    raise AssertionError(f"Tab does not come back from {steps[-1]!r} {name_of(steps[-1])!r}")


def mates_of(widget: QWidget) -> list[QAbstractButton]:
    """Return the buttons of which one at a time is chosen, and between which the arrow keys go."""
    group = widget.group() if isinstance(widget, QAbstractButton) else None
    return group.buttons() if group is not None and group.exclusive() else []


def name_of(widget: QWidget) -> str:
    """Return what a reader of the screen would call a widget."""
    said = [widget.accessibleName()]
    if isinstance(widget, QAbstractButton):
        said.append(widget.text())
    if isinstance(widget, QLineEdit):
        said.append(widget.placeholderText())
    if isinstance(widget, QAbstractSpinBox):
        said.append(widget.text())
    buddies = [label.text() for label in widget.window().findChildren(QLabel) if label.buddy() is widget]
    return next((text for text in [*said, *buddies] if text), "")


@pytest.mark.parametrize("title", PAGES)
def test_tab_leads_to_everything_on_a_page_and_back(window: Window, title: str) -> None:
    window.show_page(title)
    QApplication.processEvents()
    page = window.pages[title]
    for table in page.findChildren(ReadTable):
        table.show_rows([["something"] * table.columnCount()] * 2)
    reached = {mate for widget in walked(window) for mate in (widget, *mates_of(widget))}
    missed = operable(page) - reached
    assert not {(type(widget).__name__, name_of(widget)) for widget in missed}


@pytest.mark.parametrize("title", PAGES)
def test_everything_operable_has_a_name(window: Window, title: str) -> None:
    window.show_page(title)
    QApplication.processEvents()
    nameless = [widget for widget in operable(window.pages[title]) if not name_of(widget)]
    assert not [(type(widget).__name__, widget.objectName(), widget.toolTip()) for widget in nameless]


@pytest.mark.parametrize(("number", "title"), list(enumerate(PAGES, start=1)))
def test_control_and_a_digit_show_a_page(window: Window, number: int, title: str) -> None:
    QTest.keyClick(window, getattr(Qt.Key, f"Key_{number}"), Qt.KeyboardModifier.ControlModifier)
    assert window.pages[title].isVisible()


def test_the_arrow_keys_choose_a_retraction(window: Window) -> None:
    window.show_page("Acquire")
    page = window.pages["Acquire"]
    first, second, *_ = page.findChildren(RetractionCard)
    first.click()
    first.setFocus()
    QTest.keyClick(first, Qt.Key.Key_Right)
    assert QApplication.focusWidget() is second
    assert second.isChecked()
