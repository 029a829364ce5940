"""Paths of the fiducials, measured and predicted, from above and from the side."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fit.result import ExperimentFit
from estimator.report.channels import fiducial_residual, root_mean_square
from estimator.report.drawing.marks import plot_measured, shade_phases
from estimator.report.drawing.rounding import round_figure
from estimator.report.drawing.scene import MM, around, farthest_row
from estimator.report.drawing.silhouette import held_from_above, silhouette
from estimator.report.drawing.within import shells_within
from estimator.report.page import SWITCHED
from estimator.report.theme import ANCHOR, GRASP, INK, MUTED, PREDICTED

FloatArray = NDArray[np.float64]

# The longest residual arrow is drawn no longer than this share of the phantom.
_LONGEST_ARROW = 0.06
# The side view spans at least this share of the phantom, so that noise looks like noise.
_SMALLEST_HEIGHT = 0.06
# Numbers closer than this share of the axes would overlap.
_COINCIDENT = (0.09, 0.06)
_ARROW = "$➝$"


def arrow_factor(fit: ExperimentFit) -> float:
    """Return by how much the residuals at the farthest state are exaggerated: 1, 2 or 5 times a power of ten."""
    residual = _farthest_residual_mm(fit)
    longest = np.linalg.norm(residual[np.isfinite(residual).all(axis=1)], axis=1).max(initial=0.0)
    if not longest > 0:
        return 1.0
    wanted = _LONGEST_ARROW * MM * max(fit.experiment.phantom.size_m) / float(longest)
    return max(1.0, round_figure(wanted))


def draw_fiducials(sheet: Figure, fit: ExperimentFit) -> None:
    """Draw the paths from above (x–y) and from the side (x–z), and the residual against time."""
    grid = sheet.add_gridspec(2, 2, left=0.06, right=0.99, bottom=0.09, top=0.91, wspace=0.15, hspace=0.36)
    above = sheet.add_subplot(grid[:, 0], title="from above", xlabel="x, mm", ylabel="y, mm")
    side = sheet.add_subplot(grid[0, 1], title="from the side (z stretched)", xlabel="x, mm", ylabel="z, mm")
    row = farthest_row(fit.experiment)
    _surroundings(above, fit.experiment)
    _paths(above, fit, [0, 1])
    _names(above, MM * fit.fiducials[0, :, [0, 1]].T)
    above.set_aspect("equal", adjustable="datalim")
    _paths(side, fit, [0, 2])
    _keep_span(side, _SMALLEST_HEIGHT * MM * max(fit.experiment.phantom.size_m))
    _names(side, MM * fit.fiducials[row, :, [0, 2]].T)
    _residual_in_time(sheet.add_subplot(grid[1, 1]), fit)
    label = f"residual at the farthest state × {arrow_factor(fit):g}"
    arrow = Line2D([], [], color=INK, linestyle="none", marker=_ARROW, markersize=13, label=label)
    handles = [*above.get_legend_handles_labels()[0], arrow]
    sheet.legend(handles=handles, loc="upper right", ncols=len(handles), borderaxespad=0.2)


def _paths(axes: Axes, fit: ExperimentFit, shown: list[int]) -> None:
    """Draw every path in two of the three coordinates, and the residuals at the farthest state."""
    measured, predicted = MM * fit.experiment.fiducials[:, :, shown], MM * fit.fiducials[:, :, shown]
    plot_measured(axes, measured[:, :, 0].ravel(), measured[:, :, 1].ravel(), size=3.6)
    lines = axes.plot(predicted[:, :, 0], predicted[:, :, 1], color=PREDICTED, linewidth=1.3)
    lines[0].set_label("predicted")
    starts = predicted[farthest_row(fit.experiment)]
    arrows = arrow_factor(fit) * _farthest_residual_mm(fit)[:, shown]
    seen = np.isfinite(arrows).all(axis=1)
    axes.quiver(
        *starts[seen].T,
        *arrows[seen].T,
        angles="xy",
        scale_units="xy",
        scale=1,
        width=0.0025,
        color=INK,
        gid=SWITCHED,
        zorder=4,
    )
    axes.update_datalim((starts + arrows)[seen])
    axes.autoscale_view()


def _keep_span(axes: Axes, smallest: float) -> None:
    low, high = axes.get_ylim()
    if high - low < smallest:
        axes.set_ylim((low + high - smallest) / 2, (low + high + smallest) / 2)


def _names(axes: Axes, places: FloatArray) -> None:
    """Write the number of each fiducial at its place (m, 2); numbers that would overlap share a line."""
    spans = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())])
    groups: list[list[int]] = []
    for number, place in enumerate(places):
        near = (g for g in groups if np.all(np.abs(places[g[0]] - place) < spans * _COINCIDENT))
        group = next(near, None)
        if group is None:
            groups.append([number])
        else:
            group.append(number)
    for group in groups:
        text = " ".join(str(number) for number in group)
        axes.annotate(text, places[group[0]], (0, 5), textcoords="offset points", ha="center", fontsize=8.5)


def _surroundings(axes: Axes, experiment: Experiment) -> None:
    """Draw the phantom, the grasp and the anchors at rest, from above, and what lies within the phantom."""
    axes.add_collection(LineCollection(list(silhouette(experiment.phantom)), colors=MUTED, linewidths=1.5))
    for anchor in experiment.anchors:
        _outline(axes, held_from_above(anchor, experiment.phantom), ANCHOR, 0.3)
    _outline(axes, held_from_above(experiment.grasp.box, experiment.phantom), GRASP, 0.3)
    for shell in shells_within(experiment.phantom):
        inside = 0.12 if shell.kind == "region" else 0.0
        _outline(axes, around(MM * shell.surface.vertices[:, :2]), MUTED, inside)
        place = MM * shell.surface.bounds.mean(axis=0)[:2]
        axes.annotate(shell.name, place, ha="center", va="center", color=MUTED, fontsize=8)


def _outline(axes: Axes, corners: FloatArray, colour: str, opacity: float) -> None:
    axes.add_patch(Polygon(corners, edgecolor="none", facecolor=colour, alpha=opacity))
    axes.add_patch(Polygon(corners, edgecolor=colour, facecolor="none", linewidth=1.5))


def _residual_in_time(axes: Axes, fit: ExperimentFit) -> None:
    shade_phases(axes, fit.experiment)
    by_row = np.array([root_mean_square(row) for row in fiducial_residual(fit)])
    axes.axhline(1, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
    plot_measured(axes, fit.experiment.time, by_row, size=3.6)
    axes.set_ylim(bottom=0)
    axes.set(title="residual of all fiducials, rms (1 is pure noise)", xlabel="time, s", ylabel="residual, σ")


def _farthest_residual_mm(fit: ExperimentFit) -> FloatArray:
    row = farthest_row(fit.experiment)
    return MM * (fit.experiment.fiducials[row] - fit.fiducials[row])
