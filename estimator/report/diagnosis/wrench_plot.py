"""Measured force and torque against time, and what is predicted without and with the causes."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from estimator.diagnosis.result import Trace
from estimator.report.channels import WRENCH_CHANNELS
from estimator.report.diagnosis.gap_plot import AFTER, BEFORE
from estimator.report.drawing.marks import phase_legend, plot_measured, shade_phases

# Small channels keep this share of the span of the largest, so that they look small.
_SMALLEST_SHARE = 0.25


def draw_wrenches(sheet: Figure, trace: Trace) -> None:
    """Draw the six channels of an experiment: force (N) above, torque (mN·m) below."""
    axes = sheet.subplots(2, 3, sharex=True)
    sheet.subplots_adjust(left=0.07, right=0.99, bottom=0.11, top=0.86, wspace=0.18, hspace=0.22)
    experiment = trace.experiment
    for row, (label, factor) in enumerate((("force, N", 1.0), ("torque, mN·m", 1e3))):
        channels = slice(3 * row, 3 * row + 3)
        measured, before, after = (
            factor * values[:, channels] for values in (experiment.wrench, trace.before, trace.after)
        )
        everything = np.stack([np.where(np.isfinite(measured), measured, before), before, after])
        low, high = everything.min(axis=(0, 1)), everything.max(axis=(0, 1))
        spans = np.maximum(high - low, _SMALLEST_SHARE * float((high - low).max()))
        for column in range(3):
            panel = axes[row, column]
            shade_phases(panel, experiment)
            plot_measured(panel, experiment.time, measured[:, column], size=4.5)
            panel.plot(
                experiment.time, before[:, column], color=BEFORE, linestyle=(0, (4, 2)), label="before"
            )
            panel.plot(experiment.time, after[:, column], color=AFTER, label="after")
            middle = (low[column] + high[column]) / 2
            reach = 0.56 * spans[column] or 1.0
            panel.set_ylim(middle - reach, middle + reach)
            panel.yaxis.set_major_locator(MaxNLocator(5))
            panel.set_title(WRENCH_CHANNELS[3 * row + column])
        axes[row, 0].set_ylabel(label)
        axes[row, 0].yaxis.set_label_coords(-0.17, 0.5)
    for panel in axes[-1]:
        panel.set_xlabel("time, s")
    handles = [*axes[0, 0].get_legend_handles_labels()[0], *phase_legend(experiment)]
    sheet.legend(handles=handles, loc="upper right", ncols=len(handles), borderaxespad=0.2)
