"""Residuals in units of the noise by channel and stretch of motion, before beside after."""

import itertools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from estimator.diagnosis.result import Trace
from estimator.report.channels import CHANNELS
from estimator.report.diagnosis.residuals import Stretch, residual_map, stretches
from estimator.report.theme import MUTED, PREDICTED

FloatArray = NDArray[np.float64]

# Noise alone leaves a cell without colour, this many σ have all of it; between them the logarithm counts.
_FAINTEST, _FULL = 1.6, 15.0
_LEGEND_SIGMA = (2, 4, 8, 15)


def draw_heat_maps(sheet: Figure, trace: Trace) -> None:
    """Draw both maps; the more colour, the farther beyond the noise."""
    left, right = sheet.subplots(1, 2, sharey=True)
    sheet.subplots_adjust(left=0.09, right=0.99, bottom=0.2, top=0.83, wspace=0.04)
    for axes, title, predicted in ((left, "before", trace.before), (right, "after", trace.after)):
        axes.set_title(title)
        _cells(axes, residual_map(trace, predicted))
        _motion(axes, stretches(trace.experiment))
    left.set_yticks(np.arange(len(CHANNELS)) + 0.5, CHANNELS)
    left.set_ylim(len(CHANNELS), 0)
    handles = [
        Patch(color=PREDICTED, alpha=float(_opacity(np.array(float(level)))), linewidth=0, label=f"{level} σ")
        for level in _LEGEND_SIGMA
    ]
    handles[-1].set_label(f"{_LEGEND_SIGMA[-1]} σ or more")
    sheet.legend(handles=handles, loc="upper right", ncols=len(handles), borderaxespad=0.2)


def _opacity(sigma: FloatArray) -> FloatArray:
    share = np.log(np.maximum(np.nan_to_num(sigma), 1e-9) / _FAINTEST) / np.log(_FULL / _FAINTEST)
    return np.clip(share, 0.0, 1.0)


def _cells(axes: Axes, values: FloatArray) -> None:
    rows, columns = values.shape
    corner = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 1, 2)
    squares = corner + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    colours = np.column_stack([np.tile(to_rgb(PREDICTED), (values.size, 1)), _opacity(values).ravel()])
    axes.add_collection(PolyCollection(list(squares), facecolors=colours, edgecolors="none"))
    missing = squares[~np.isfinite(values).ravel()]
    axes.add_collection(
        PolyCollection(list(missing), facecolors="none", edgecolors=MUTED, hatch="///", linewidths=0)
    )
    axes.set_xlim(0, columns)
    axes.set_yticks(np.arange(rows + 1), minor=True)
    axes.grid(visible=False)
    axes.grid(visible=True, which="minor", axis="y")
    axes.tick_params(which="minor", length=0)


def _motion(axes: Axes, parts: list[Stretch]) -> None:
    """Name the phases below the map, and part them."""
    edges = [n for n in range(1, len(parts)) if _way(parts[n]) != _way(parts[n - 1])]
    for edge in edges:
        axes.axvline(edge, color=MUTED, linewidth=1.2)
    bounds = [0, *edges, len(parts)]
    middles = [(a + b) / 2 for a, b in itertools.pairwise(bounds)]
    ways = [_way(parts[a]) for a in bounds[:-1]]
    axes.set_xticks(middles, ways)
    axes.tick_params(axis="x", length=0, pad=18)
    steps = [n for n in range(len(parts)) if n == 0 or parts[n].step != parts[n - 1].step]
    for n in steps[:: max(1, len(steps) // 12)]:
        axes.annotate(
            str(parts[n].step),
            (n + 0.5, 0),
            (0, -11),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=8,
            color=MUTED,
        )
    axes.set_xlabel("step of the retraction, ramps and holds in turn")


def _way(part: Stretch) -> str:
    return "way back" if part.phase.startswith("return") else "retraction"
