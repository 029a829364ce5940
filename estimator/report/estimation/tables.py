"""The numbers behind an estimation: residuals and experiments."""

from itertools import chain

import numpy as np

from estimator.experiment import Experiment
from estimator.fit.result import Estimate
from estimator.report import page
from estimator.report.drawing.scene import farthest_row
from estimator.report.estimation.facts import residual_rows
from estimator.report.page import Html


def residual_table(estimate: Estimate) -> Html:
    """Return the residuals of every channel (rows) in every experiment (columns)."""
    head = ["channel"]
    for fit in estimate.fits:
        head += [f"{fit.experiment.name}: rms", "rms, σ", "scatter, σ"]
    by_channel = zip(*(residual_rows(fit) for fit in estimate.fits), strict=True)
    rows = [[cells[0].channel, *chain(*(cell.texts for cell in cells))] for cells in by_channel]
    return page.table("Residuals, measured minus predicted", head, rows)


def experiment_table(estimate: Estimate) -> Html:
    """Return what each experiment was, and the stated noise of its sensors."""
    head = (
        "experiment",
        "trajectory",
        "rows",
        "time, s",
        "farthest, mm",
        "σ force, N",
        "σ torque, mN·m",
        "σ fiducial, µm",
        "σ position, µm",
    )
    return page.table("Experiments", head, [_experiment_cells(fit.experiment) for fit in estimate.fits])


def _experiment_cells(experiment: Experiment) -> tuple[str, ...]:
    sensor = experiment.sensor
    travel = experiment.position[farthest_row(experiment)] - experiment.position[0]
    return (
        experiment.name,
        experiment.trajectory_kind.replace("_", " "),
        str(len(experiment.time)),
        f"{experiment.time[-1]:.1f}",
        f"{1e3 * float(np.linalg.norm(travel)):.1f}",
        f"{sensor.force_std:.3g}",
        f"{1e3 * sensor.torque_std:.3g}",
        f"{1e6 * sensor.fiducial_std:.3g}",
        f"{1e6 * sensor.position_std:.3g}",
    )
