"""A picture of every page, taken from the real window over the emulated laboratory.

Usage::

    python -m gui.screenshots docs/window --case show/case001
    python -m gui.screenshots pictures --rig lab.toml
    python -m gui.screenshots pictures --theme dark --scale 1.5 --sessions sessions
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QSize

from daq.errors import DaqError, SessionError
from daq.plans import Trial
from daq.rig import read_rig
from daq.trajectories import STANDARD
from gui.app import Desk
from gui.context import Context
from gui.pages.acquire import AcquirePage
from gui.pages.calibrate import CalibratePage
from gui.pages.diagnose import DiagnosePage
from gui.pages.estimate import EstimatePage
from gui.pages.rig import RigPage
from gui.pages.sessions import SessionsPage
from gui.rehearsal import application_without_display, wait_for, wait_until
from gui.theme import DARK, LIGHT
from gui.window import Window

_SIZE = QSize(1440, 900)
_STEP_SHOWN = 5
_VIEWS_SHOWN = 4
_PATIENCE_S = 240.0
_PATIENCE_OF_WORK_S = 1200.0
_NO_MORE = 10**6
"""A view that the emulated person does not have: the board is put away."""


def take(folder: Path, desk: Desk, cases: Sequence[Path] = ()) -> Iterator[Path]:
    """Rehearse a morning in the window and yield each picture as it is taken.

    ``cases``, of one phantom, are estimated and diagnosed; without any those pages stay empty.
    """
    desk.open_virtual()
    wait_until(lambda: desk.window is not None, "the emulated laboratory", _PATIENCE_S)
    window, context = desk.window, desk.context
    assert window is not None
    assert context is not None
    window.resize(_SIZE)
    wait_until(lambda: context.link.state.phase == "ready", "a connected rig", _PATIENCE_S)
    wait_for(8.0)
    context.link.take_tare()
    wait_for(2.0)
    window.show_page("Rig")
    yield _picture(window, folder / "rig.png")
    yield from _calibrate(window, context, folder)
    desk.laboratory.help("board", _NO_MORE)
    yield from _acquire(window, context, folder)
    window.show_page("Sessions")
    sessions = window.page(SessionsPage)
    wait_until(lambda: sessions.table.entry is not None, "a list of sessions", _PATIENCE_S)
    wait_for(1.5)
    yield _picture(window, folder / "sessions.png")
    for page in (window.page(EstimatePage), window.page(DiagnosePage)):
        window.show_page(page.title)
        if cases:
            _compute(page, cases)
        wait_for(1.5)
        yield _picture(window, folder / f"{page.title.lower()}.png")
    if cases:
        window.page(DiagnosePage).result.details.show_body()
        wait_for(1.0)
        yield _picture(window, folder / "diagnose_body.png")


def _compute(page: EstimatePage | DiagnosePage, cases: Sequence[Path]) -> None:
    page.picker.choose(cases)
    page.begin.click()
    wait_until(lambda: page.strip.idle, f"an end of the page {page.title}'s work", _PATIENCE_OF_WORK_S)


def _calibrate(window: Window, context: Context, folder: Path) -> Iterator[Path]:
    page = window.page(CalibratePage)
    window.show_page("Calibrate")
    page.choose("camera" if len(context.rig.cameras) == 1 else "stereo")
    taken: list[object] = []
    page.wizard.view_taken.connect(taken.append)
    while len(taken) < _VIEWS_SHOWN:
        before = len(taken)
        page.take_button.click()
        wait_until(lambda before=before: len(taken) > before, "a view of the board", _PATIENCE_S)  # type: ignore[misc]
    wait_for(1.0)
    yield _picture(window, folder / "calibrate.png")


def _acquire(window: Window, context: Context, folder: Path) -> Iterator[Path]:
    page = window.page(AcquirePage)
    window.show_page("Acquire")
    page.runner.set_labels(
        replace(page.runner.labels, operator="N. N.", name="{phantom}_{trajectory}_{order}")
    )
    for kind, retraction in STANDARD.items():
        page.runner.add(Trial(kind, steps=retraction.steps, step_length_m=retraction.step_length))
    wait_for(2.0)
    page.run_button.click()
    wait_until(
        lambda: context.link.state.step >= _STEP_SHOWN or not page.runner.running,
        "a pull under way",
        _PATIENCE_S,
    )
    if not page.runner.running:
        raise SessionError(f"the pull has ended early: {page.runner.queue[0].remark}")
    wait_for(1.5)
    yield _picture(window, folder / "acquire.png")
    window.stop()
    wait_until(lambda: context.link.state.session is None, "a sealed session", _PATIENCE_S)
    wait_for(1.0)
    yield _picture(window, folder / "held.png")
    window.rig_bar.release.click()
    window.page(RigPage).home_button.click()
    wait_until(lambda: context.link.state.phase == "ready", "a released robot", _PATIENCE_S)
    while window.messages.message is not None:
        window.messages.dismiss()


def _picture(window: Window, path: Path) -> Path:
    window.grab().save(str(path))
    return path


def main(arguments: Sequence[str] | None = None) -> int:
    """Take the pictures and tell where they are."""
    parser = argparse.ArgumentParser(prog="python -m gui.screenshots", description=main.__doc__)
    parser.add_argument("folder", type=Path, help="where to put them")
    parser.add_argument("--theme", choices=("light", "dark"), default="light")
    parser.add_argument(
        "--scale", type=float, default=1.0, help="as a desktop's scaling (default: %(default)s)"
    )
    parser.add_argument("--sessions", type=Path, help="to be shown (default: none but those made here)")
    parser.add_argument(
        "--case",
        type=Path,
        action="append",
        default=[],
        help="experiments of one phantom, to be estimated and diagnosed",
    )
    parser.add_argument(
        "--rig",
        type=Path,
        help="rig file whose devices are all emulated (default: the emulated laboratory's)",
    )
    options = parser.parse_args(arguments)
    try:
        own = None if options.rig is None else read_rig(options.rig)
    except DaqError as error:
        parser.error(str(error))
    os.environ["QT_SCALE_FACTOR"] = f"{options.scale:g}"
    options.folder.mkdir(parents=True, exist_ok=True)
    theme = DARK if options.theme == "dark" else LIGHT
    with application_without_display(theme), tempfile.TemporaryDirectory(prefix="screenshots-") as made:
        desk = Desk(own, options.sessions or Path(made) / "sessions")
        for path in take(options.folder, desk, options.case):
            sys.stdout.write(f"{path}\n")
            sys.stdout.flush()
        desk.end()
    return 0


if __name__ == "__main__":
    sys.exit(main())
