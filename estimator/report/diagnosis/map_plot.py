"""The phantom from above: what is left of the fiducials' misfit, before beside after, and the place of the cause."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Ellipse, Patch, Polygon
from numpy.typing import NDArray

from estimator.diagnosis.result import Diagnosis, Trace, Where
from estimator.effects import blocks
from estimator.experiment import Box, Phantom
from estimator.report.diagnosis.quantities import percent
from estimator.report.diagnosis.residuals import farthest_fiducials_mm
from estimator.report.drawing.rounding import round_figure
from estimator.report.drawing.scene import MM, around, rectangle, within_mm
from estimator.report.drawing.silhouette import extent_mm, held_from_above, silhouette
from estimator.report.drawing.within import shells_within
from estimator.report.theme import ANCHOR, GRASP, INK, MEASURED, MUTED, PREDICTED, TRUTH

FloatArray = NDArray[np.float64]

# The longest residual arrow is drawn about as long as this share of the phantom.
_LONGEST_ARROW = 0.18
_INTERVAL_95 = 1.96
_MARGIN = 0.12


def arrow_factor(trace: Trace) -> float:
    """Return by how much both maps exaggerate residuals: 1, 2 or 5 times a power of ten."""
    lengths = [
        np.linalg.norm(farthest_fiducials_mm(trace, predicted)[1], axis=1)
        for predicted in (trace.before, trace.after)
    ]
    longest = np.nanmax([0.0, *np.concatenate(lengths)])
    if not longest > 0:
        return 1.0
    return max(
        1.0, round_figure(_LONGEST_ARROW * MM * max(trace.experiment.phantom.size_m[:2]) / float(longest))
    )


def draw_map(sheet: Figure, diagnosis: Diagnosis, trace: Trace) -> None:
    """Draw the residuals of the fiducials at the farthest state of an experiment, before beside after."""
    left, right = sheet.subplots(1, 2)
    sheet.subplots_adjust(left=0.06, right=0.99, bottom=0.1, top=0.85, wspace=0.06)
    for axes, title, predicted, colour in (
        (left, "before: the baseline misses", trace.before, PREDICTED),
        (right, "after: with the causes in the model", trace.after, TRUTH),
    ):
        axes.set(title=title, xlabel="x, mm")
        _surroundings(axes, trace, diagnosis.where)
        _residuals(axes, trace, predicted, colour)
        _local_cause(axes, diagnosis.where)
        axes.set_aspect("equal")
    left.set_ylabel("y, mm")
    sheet.legend(handles=_legend(trace, diagnosis.where), loc="upper right", ncols=7, borderaxespad=0.2)


def _surroundings(axes: Axes, trace: Trace, where: Where) -> None:
    """Draw phantom, anchors and grasp at rest, with the probability that the cause sits there.

    And cavities and regions of another stiffness, which the model has.
    """
    experiment = trace.experiment
    whole = extent_mm(experiment.phantom)
    pieces = list(silhouette(experiment.phantom))
    axes.add_collection(LineCollection(pieces, colors=MUTED, linewidths=1.4, zorder=1))
    for anchor in experiment.anchors:
        _outline(
            axes, _anchored(anchor, experiment.phantom, whole), ANCHOR, _block(blocks.ANCHOR, where), 0.4
        )
    grasped = held_from_above(experiment.grasp.box, experiment.phantom)
    _outline(axes, grasped, GRASP, _block(blocks.GRASP, where), 0.3)
    for shell in shells_within(experiment.phantom):
        inside = 0.12 if shell.kind == "region" else 0.0
        _outline(axes, around(MM * shell.surface.vertices[:, :2]), MUTED, shell.name, inside)
    interior = _block(blocks.INTERIOR, where)
    axes.annotate(
        interior,
        (float(whole[:, 0].mean()), float(whole[0, 1])),
        (0, 5),
        textcoords="offset points",
        ha="center",
        color=MUTED,
        fontsize=9,
    )
    low, high = whole + np.outer([-1, 1], _MARGIN * np.ptp(whole, axis=0) / 2)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])


def _block(block: blocks.Block, where: Where) -> str:
    probability = where.blocks.get(block.name, math.nan)
    return f"{block.name} {percent(probability)}" if math.isfinite(probability) else ""


def _anchored(anchor: Box, phantom: Phantom, whole: FloatArray) -> FloatArray:
    if phantom.surface is not None:
        return held_from_above(anchor, phantom)
    return rectangle(_at_least(within_mm(anchor, whole), whole[1]))


def _at_least(box: FloatArray, half: FloatArray) -> FloatArray:
    """Return a box, thickened outwards where it is a mere face, so that it can be seen."""
    least = 0.03 * half.max()
    flat = (box[1] - box[0]) < least
    outward = np.sign(box.mean(axis=0))
    thick = box.copy()
    thick[0] = np.where(flat & (outward < 0), box[1] - least, thick[0])
    thick[1] = np.where(flat & (outward > 0), box[0] + least, thick[1])
    return thick


def _outline(axes: Axes, corners: FloatArray, colour: str, text: str, opacity: float) -> None:
    (x, y), (width, depth) = corners.min(axis=0), np.ptp(corners, axis=0)
    axes.add_patch(Polygon(corners, edgecolor="none", facecolor=colour, alpha=opacity, zorder=1))
    axes.add_patch(Polygon(corners, edgecolor=colour, facecolor="none", linewidth=1.4, zorder=1))
    upright = depth > 3 * width
    axes.annotate(
        text,
        (x + width, y + depth / 2) if upright else (x + width / 2, y),
        (4, 0) if upright else (0, -4),
        textcoords="offset points",
        rotation=90 if upright else 0,
        ha="left" if upright else "center",
        va="center" if upright else "top",
        color=colour,
        fontsize=9,
    )


def _residuals(axes: Axes, trace: Trace, predicted: FloatArray, colour: str) -> None:
    places, missed = farthest_fiducials_mm(trace, predicted)
    rest = MM * trace.experiment.fiducials_rest
    axes.plot(*rest[:, :2].T, "o", color=MUTED, markersize=3, alpha=0.6, zorder=2)
    axes.plot(*places[:, :2].T, "o", color=MEASURED, markersize=5.5, zorder=3)
    seen = np.isfinite(missed).all(axis=1)
    factor = arrow_factor(trace)
    axes.quiver(
        *places[seen, :2].T,
        *(factor * missed[seen, :2]).T,
        angles="xy",
        scale_units="xy",
        scale=1,
        width=0.006,
        color=colour,
        zorder=4,
    )


def _local_cause(axes: Axes, where: Where) -> None:
    """Draw the circle of a local cause, and where its centre may lie."""
    if where.centre is None:
        return
    x, y = MM * np.array(where.centre[:2])
    if where.radius is not None:
        axes.add_patch(
            Circle((x, y), MM * where.radius, facecolor=INK, edgecolor="none", alpha=0.1, zorder=1.5)
        )
        axes.add_patch(
            Circle((x, y), MM * where.radius, facecolor="none", edgecolor=INK, linewidth=1.6, zorder=5)
        )
    axes.plot(x, y, "+", color=INK, markersize=12, markeredgewidth=1.8, zorder=5)
    if where.centre_std is not None:
        width, height = 2 * _INTERVAL_95 * MM * np.array(where.centre_std[:2])
        axes.add_patch(
            Ellipse(
                (x, y),
                width,
                height,
                facecolor="none",
                edgecolor=INK,
                linewidth=1.2,
                linestyle=(0, (3, 2)),
                zorder=5,
            )
        )


def _legend(trace: Trace, where: Where) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=MUTED, linestyle="none", marker="o", markersize=3, label="bead at rest"),
        Line2D([], [], color=MEASURED, linestyle="none", marker="o", markersize=5.5, label="pulled"),
        Line2D([], [], color=PREDICTED, linestyle="none", marker="$➝$", markersize=13, label="missed by"),
        Patch(color=ANCHOR, alpha=0.5, label="anchored"),
        Patch(color=GRASP, alpha=0.5, label="gripped"),
    ]
    handles[2].set_label(f"measured − predicted × {arrow_factor(trace):g}")
    if where.centre is not None:
        handles.append(
            Line2D([], [], color=INK, linestyle="none", marker="+", markersize=11, label="local cause")
        )
        handles.append(
            Line2D([], [], color=INK, linestyle=(0, (3, 2)), linewidth=1.2, label="its centre, 95 %")
        )
    return handles
