"""The planned way over the phantom: a block's box, or a surface with what lies in it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QImage
from pytestqt.qtbot import QtBot

from daq.virtual_rig.layout import SPECIMEN
from estimator.experiment import Phantom, TissueRegion
from estimator.geometry.shapes import sphere_surface
from estimator.surfaces.surface import Surface
from estimator.surfaces.writing import write_ply
from gui.widgets.view_3d.path_view import PathView


def drawn(qtbot: QtBot, phantom: Phantom) -> NDArray[np.int64]:
    view = PathView(replace(SPECIMEN, phantom=phantom, fiducials_m=()))
    qtbot.addWidget(view)
    view.resize(300, 220)
    view.show()
    image = view.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    return rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).astype(np.int64)


def test_a_surface_is_drawn_with_its_region_and_without_its_file_its_box(
    qtbot: QtBot, tmp_path: Path
) -> None:
    write_ply(sphere_surface(0.04, 3), tmp_path / "ball.ply")
    lump = sphere_surface(0.01, 2)
    write_ply(Surface(lump.vertices + 0.01, lump.triangles), tmp_path / "lump.ply")
    box = drawn(qtbot, Phantom("surface", (0.08, 0.08, 0.08), tmp_path / "not_there.ply", 1070.0, "m"))
    plain = Phantom("surface", (0.08, 0.08, 0.08), tmp_path / "ball.ply", 1070.0, "m")
    ball = drawn(qtbot, plain)
    with_lump = drawn(qtbot, replace(plain, regions=(TissueRegion("lump", tmp_path / "lump.ply", 2.0, "m"),)))
    background = ball[1, 1]
    assert np.count_nonzero((ball != background).any(axis=2)) > np.count_nonzero(
        (box != background).any(axis=2)
    )
    changed = np.argwhere((with_lump != ball).any(axis=2))
    # a circle of a quarter of the ball's width
    ball_wide = np.ptp(np.argwhere((ball != background).any(axis=2)), axis=0).max()
    assert 0.2 * ball_wide < np.ptp(changed, axis=0).max() < 0.35 * ball_wide
