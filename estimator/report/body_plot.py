"""The deformed body at the farthest state, with what holds it, what pulls it and what was seen of it."""

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from numpy.typing import NDArray

from estimator.fem.mesh import Mesh
from estimator.fem.surface import boundary_faces, facets, outlines
from estimator.fit.result import ExperimentFit
from estimator.report.scene import (
    BOX_FACES,
    MM,
    corners_mm,
    extent_mm,
    farthest_row,
    moved_with_gripper_mm,
    within_mm,
)
from estimator.report.stretch import largest_stretch
from estimator.report.theme import ANCHOR, GRASP, INK, LINE, MEASURED, MUTED, PREDICTED

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ELEVATION_DEG, _AZIMUTH_DEG = 38.0, -115.0
_COLOUR_MAP = "viridis"
# Stretch is singular along the rim of the grasp; the scale ends where this share of the surface lies below.
_SCALE_PERCENTILE = 99.0


def draw_body(sheet: Figure, mesh: Mesh, fit: ExperimentFit) -> None:
    """Draw the surface coloured by the largest principal stretch."""
    axes = sheet.add_axes((0.0, 0.0, 0.88, 1.0), projection="3d", computed_zorder=False, proj_type="ortho")
    assert isinstance(axes, Axes3D)
    axes.view_init(_ELEVATION_DEG, _AZIMUTH_DEG)
    points = MM * (mesh.points + fit.displacement)
    scale = _surface(axes, mesh, points, largest_stretch(mesh, fit.displacement))
    rest = extent_mm(mesh.points)
    _box(axes, corners_mm(rest), MUTED, filled=0.0, label="at rest")
    for anchor in fit.experiment.anchors:
        _box(axes, corners_mm(within_mm(anchor, rest)), ANCHOR, filled=0.5, label="anchored")
    row = farthest_row(fit.experiment)
    grasp = corners_mm(within_mm(fit.experiment.grasp.box, rest))
    _box(axes, moved_with_gripper_mm(grasp, fit.experiment, row), GRASP, filled=0.35, label="gripped")
    _fiducials(axes, fit, row)
    _frame(axes, np.vstack([points, rest]))
    bar = sheet.colorbar(scale, cax=sheet.add_axes((0.9, 0.2, 0.018, 0.6)), extend="max")
    bar.set_label("largest principal stretch")
    handles = {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    sheet.legend(handles.values(), handles.keys(), loc="upper left", ncols=len(handles))
