"""Marks that several figures share: what was measured, and the phases of the motion."""

from itertools import groupby

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from numpy.typing import NDArray

from estimator.experiment import PHASES, Experiment
from estimator.report.theme import GRASP, MEASURED, MUTED

FloatArray = NDArray[np.float64]

# Shade of each phase: a colour and its opacity; holds are darker, the way back has another hue.
_SHADES = {
    "hold": (MUTED, 0.13),
    "return": (GRASP, 0.10),
    "return_hold": (GRASP, 0.24),
}
_MARGIN = 0.015
# More marks than these would make the page large as vectors; they become pixels.
_MOST_VECTOR_MARKS = 1000


def plot_measured(axes: Axes, x: FloatArray, y: FloatArray, size: float) -> None:
    """Draw measured points; those that are NaN are left out."""
    axes.plot(
        x,
        y,
        linestyle="none",
        marker="o",
        markersize=size,
        markeredgewidth=0,
        color=MEASURED,
        label="measured",
        rasterized=too_many(x),
    )


def too_many(marks: FloatArray) -> bool:
    """Tell whether marks at these places are better drawn as pixels."""
    return marks.size > _MOST_VECTOR_MARKS


def shade_phases(axes: Axes, experiment: Experiment) -> None:
    """Shade the stretches of time of each phase; they meet half-way between two rows."""
    time = experiment.time
    edges = np.concatenate([time[:1], (time[1:] + time[:-1]) / 2, time[-1:]])
    stretches: dict[str, list[tuple[float, float]]] = {phase: [] for phase in PHASES}
    row = 0
    for phase, rows in groupby(experiment.phase):
        end = row + len(list(rows))
        stretches[phase].append((edges[row], edges[end] - edges[row]))
        row = end
    for phase, (colour, opacity) in _SHADES.items():
        if stretches[phase]:
            axes.broken_barh(
                stretches[phase],
                (0, 1),
                transform=axes.get_xaxis_transform(),
                facecolor=colour,
                alpha=opacity,
                linewidth=0,
                zorder=0,
            )
    margin = _MARGIN * (edges[-1] - edges[0])
    axes.set_xlim(edges[0] - margin, edges[-1] + margin)


def phase_legend(experiment: Experiment) -> list[Patch]:
    """Return legend entries for the shades of the phases that occur."""
    return [
        Patch(color=colour, alpha=opacity, linewidth=0, label=phase.replace("_", " "))
        for phase, (colour, opacity) in _SHADES.items()
        if phase in experiment.phase
    ]
