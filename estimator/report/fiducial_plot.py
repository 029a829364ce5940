"""Paths of the fiducials, measured and predicted, from above and from the side."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from estimator.fit.result import ExperimentFit
from estimator.report.channels import fiducial_residual, root_mean_square
from estimator.report.page import SWITCHED
from estimator.report.scene import MM, extent_mm, farthest_row, within_mm
from estimator.report.theme import ANCHOR, GRASP, INK, MEASURED, MUTED, PREDICTED
from estimator.report.wrench_plot import shade_phases

FloatArray = NDArray[np.float64]

# The longest residual arrow is drawn no longer than this share of the phantom.
_LONGEST_ARROW = 0.1
_SMALLEST_HEIGHT_MM = 1.0
_MOST_VECTOR_POINTS = 2000


def arrow_factor(fit: ExperimentFit) -> float:
    """Return by how much the residuals at the farthest state are exaggerated: 1, 2 or 5 times a power of ten."""
    residual = _farthest_residual_mm(fit)
    longest = np.linalg.norm(residual[np.isfinite(residual).all(axis=1)], axis=1).max(initial=0.0)
    if not longest > 0:
        return 1.0
    wanted = _LONGEST_ARROW * MM * max(fit.experiment.phantom.size_m) / float(longest)
    decade = 10.0 ** math.floor(math.log10(wanted))
    return max(1.0, max(step * decade for step in (1, 2, 5) if step * decade <= wanted))


def draw_fiducials(sheet: Figure, fit: ExperimentFit) -> None:
    """Draw the paths from above (x–y) and from the side (x–z), and the residual against time."""
    grid = sheet.add_gridspec(2, 2, left=0.06, right=0.99, bottom=0.09, top=0.92, wspace=0.14, hspace=0.32)
    above = sheet.add_subplot(grid[:, 0])
    side = sheet.add_subplot(grid[0, 1])
    _surroundings(above, fit)
    _paths(above, fit, 1)
    above.set_aspect("equal", adjustable="datalim")
    above.set(title="from above", xlabel="x, mm", ylabel="y, mm")
    _paths(side, fit, 2)
    _height_limits(side, fit)
    side.set(title="from the side (z stretched)", xlabel="x, mm", ylabel="z, mm")
    _residual_in_time(sheet.add_subplot(grid[1, 1]), fit)
    handles, labels = above.get_legend_handles_labels()
    sheet.legend(handles, labels, loc="upper right", ncols=len(handles), borderaxespad=0.2)


def _paths(axes: Axes, fit: ExperimentFit, upward: int) -> None:
    """Draw every path, with x to the right and coordinate ``upward`` up."""
    shown = [0, upward]
    measured, predicted = MM * fit.experiment.fiducials[:, :, shown], MM * fit.fiducials[:, :, shown]
    axes.plot(
        measured[:, :, 0].ravel(),
        measured[:, :, 1].ravel(),
        linestyle="none",
        marker="o",
        markersize=3,
        color=MEASURED,
        label="measured",
        rasterized=measured[:, :, 0].size > _MOST_VECTOR_POINTS,
    )
    lines = axes.plot(predicted[:, :, 0], predicted[:, :, 1], color=PREDICTED, linewidth=1.3)
    lines[0].set_label("predicted")
    row = farthest_row(fit.experiment)
    residual = _farthest_residual_mm(fit)[:, shown]
    seen = np.isfinite(residual).all(axis=1)
    factor = arrow_factor(fit)
    axes.quiver(
        *predicted[row, seen].T,
        *residual[seen].T,
        angles="xy",
        scale_units="xy",
        scale=1 / factor,
        width=0.004,
        color=INK,
        gid=SWITCHED,
        zorder=4,
        label=f"residual × {factor:g}",
    )
    for number, place in enumerate(predicted[0]):
        axes.annotate(
            str(number), place, (-4, 3), textcoords="offset points", ha="right", fontsize=8, color=MUTED
        )


def _surroundings(axes: Axes, fit: ExperimentFit) -> None:
    """Draw the phantom, the grasp and the anchors at rest, from above."""
    half = MM * np.array(fit.experiment.phantom.size_m) / 2
    whole = np.stack([-half, half])
    axes.add_patch(_rectangle(whole, edgecolor=MUTED, facecolor="none", linewidth=1))
    for anchor in fit.experiment.anchors:
        axes.add_patch(_rectangle(within_mm(anchor, whole), edgecolor=ANCHOR, facecolor=ANCHOR, linewidth=3))
    grasp = within_mm(fit.experiment.grasp.box, whole)
    axes.add_patch(_rectangle(grasp, edgecolor=GRASP, facecolor=GRASP, alpha=0.3, linewidth=1.5))


def _rectangle(box: FloatArray, **style: object) -> Rectangle:
    size = box[1] - box[0]
    return Rectangle((box[0, 0], box[0, 1]), size[0], size[1], **style)


def _height_limits(axes: Axes, fit: ExperimentFit) -> None:
    """Leave room for the arrows, which do not count when matplotlib chooses limits."""
    row = farthest_row(fit.experiment)
    tips = MM * fit.fiducials[row] + arrow_factor(fit) * _farthest_residual_mm(fit)
    points = np.vstack([MM * fit.fiducials.reshape(-1, 3), MM * fit.experiment.fiducials.reshape(-1, 3), tips])
    low, high = np.nanmin(points[:, 2]), np.nanmax(points[:, 2])
    reach = 0.55 * max(float(high - low), _SMALLEST_HEIGHT_MM)
    axes.set_ylim((low + high) / 2 - reach, (low + high) / 2 + reach)


def _residual_in_time(axes: Axes, fit: ExperimentFit) -> None:
    shade_phases(axes, fit.experiment)
    by_row = [root_mean_square(row) for row in fiducial_residual(fit)]
    axes.axhline(1, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.plot(fit.experiment.time, by_row, linestyle="none", marker="o", markersize=3.2, color=MEASURED)
    axes.set_ylim(bottom=0)
    axes.set(title="residual of all fiducials (rms; 1 is pure noise)", xlabel="time, s", ylabel="residual, σ")


def _farthest_residual_mm(fit: ExperimentFit) -> FloatArray:
    row = farthest_row(fit.experiment)
    return MM * (fit.experiment.fiducials[row] - fit.fiducials[row])
