"""What was measured in one experiment, against time: the gripper's way, the force and the torque."""

import numpy as np
from matplotlib.figure import Figure

from estimator.experiment import Experiment
from estimator.report.drawing.marks import phase_legend, shade_phases
from estimator.report.drawing.scene import MM

SIZE_IN = (11.4, 3.4)


def draw_experiment(sheet: Figure, experiment: Experiment) -> None:
    """Draw the gripper's displacement (mm), the force (N) and the torque (mN·m) of the tissue on it."""
    columns = sheet.subplots(1, 3, sharex=True)
    sheet.subplots_adjust(left=0.06, right=0.99, bottom=0.16, top=0.86, wspace=0.2)
    signals = (
        ("displacement, mm", "xyz", MM * (experiment.position - experiment.position[0])),
        ("force, N", ("fx", "fy", "fz"), experiment.wrench[:, :3]),
        ("torque, mN·m", ("tx", "ty", "tz"), 1e3 * experiment.wrench[:, 3:]),
    )
    for axes, (title, names, values) in zip(columns, signals, strict=True):
        shade_phases(axes, experiment)
        for name, column in zip(names, np.asarray(values).T, strict=True):
            axes.plot(experiment.time, column, ".-", markersize=4, label=name)
        axes.set(title=title, xlabel="time, s")
        axes.legend(ncols=3)
    sheet.legend(handles=phase_legend(experiment), loc="upper right", ncols=4, borderaxespad=0.2)
