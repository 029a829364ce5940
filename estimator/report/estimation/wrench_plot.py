"""Force and torque against time: measured, predicted, and what is left in units of the noise."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fit.result import ExperimentFit
from estimator.report.channels import WRENCH_CHANNELS, wrench_residual
from estimator.report.drawing.marks import phase_legend, plot_measured, shade_phases, too_many
from estimator.report.theme import INK, MEASURED, MUTED, PREDICTED

FloatArray = NDArray[np.float64]

_SMALLEST_SHARE = 0.25
_STRIP_SIGMA = 4.0


def draw_wrench(sheet: Figure, fit: ExperimentFit) -> None:
    """Draw force (N) and torque (mN·m) of an experiment, and below each its residual in units of the noise.

    Small channels keep at least a quarter of the span of the largest, so that they look small.
    """
    axes = sheet.subplots(4, 3, sharex=True, height_ratios=[3, 1.3, 3, 1.3])
    sheet.subplots_adjust(left=0.07, right=0.99, bottom=0.08, top=0.91, wspace=0.18, hspace=0.24)
    residual = wrench_residual(fit)
    reach = _strip_reach(residual)
    for top, label, first, factor in ((0, "force, N", 0, 1.0), (2, "torque, mN·m", 3, 1e3)):
        measured, predicted, std = (
            factor * v[:, first : first + 3] for v in (fit.experiment.wrench, fit.wrench, fit.wrench_std)
        )
        limits = _limits(measured, predicted, float(std.max()))
        for column in range(3):
            channel = first + column
            profile, strip = axes[top, column], axes[top + 1, column]
            _profile(profile, fit.experiment, measured[:, column], predicted[:, column], std[:, column])
            profile.set_ylim(*limits[column])
            profile.yaxis.set_major_locator(MaxNLocator(5))
            profile.set_title(WRENCH_CHANNELS[channel])
            _strip(strip, fit.experiment, residual[:, channel], reach)
        axes[top, 0].set_ylabel(label)
        axes[top + 1, 0].set_ylabel("residual, σ")
    for column in axes[-1]:
        column.set_xlabel("time, s")
    for row in axes:
        row[0].yaxis.set_label_coords(-0.17, 0.5)
    handles = [*axes[0, 0].get_legend_handles_labels()[0], *phase_legend(fit.experiment)]
    sheet.legend(handles=handles, loc="upper right", ncols=len(handles), borderaxespad=0.2)


def _strip(axes: Axes, experiment: Experiment, residual_sigma: FloatArray, reach: float) -> None:
    """Draw a signal's residual in units of the noise; between the dashed lines lie 95 % of pure noise."""
    shade_phases(axes, experiment)
    axes.axhline(0, color=INK, linewidth=0.8)
    for bound in (-1.96, 1.96):
        axes.axhline(bound, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
    plot_measured(axes, experiment.time, residual_sigma, size=2.6)
    axes.set_ylim(-reach, reach)
    axes.yaxis.set_major_locator(MaxNLocator(2, integer=True, symmetric=True))
    axes.grid(visible=False)


def _profile(
    axes: Axes, experiment: Experiment, measured: FloatArray, predicted: FloatArray, std: FloatArray
) -> None:
    shade_phases(axes, experiment)
    axes.errorbar(
        experiment.time,
        measured,
        std,
        fmt="o",
        markersize=3.2,
        elinewidth=1,
        color=MEASURED,
        label="measured ± 1 σ",
        rasterized=too_many(measured),
    )
    axes.plot(experiment.time, predicted, color=PREDICTED, label="predicted", zorder=3)


def _limits(measured: FloatArray, predicted: FloatArray, std: float) -> list[tuple[float, float]]:
    """Return the limits of each column's axis."""
    both = np.vstack([measured, predicted])
    low, high = np.nanmin(both, axis=0) - std, np.nanmax(both, axis=0) + std
    spans = np.maximum(high - low, _SMALLEST_SHARE * (high - low).max())
    middle = (low + high) / 2
    return [(float(m - 0.55 * s), float(m + 0.55 * s)) for m, s in zip(middle, spans, strict=True)]


def _strip_reach(residual: FloatArray) -> float:
    measured = residual[np.isfinite(residual)]
    return max(_STRIP_SIGMA, 1.1 * float(np.abs(measured).max())) if len(measured) else _STRIP_SIGMA
