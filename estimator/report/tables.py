"""The numbers behind an estimation: residuals, experiments, fit and specimen."""

import math
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fit.result import Estimate, ExperimentFit
from estimator.report import page
from estimator.report.channels import (
    CHANNELS,
    ChannelResidual,
    channel_residuals,
    root_mean_square,
    worst_fiducial,
)
from estimator.report.page import Html
from estimator.report.scene import MM, farthest_row, within_mm

# The units that people read, and how many of them make the SI unit.
_DISPLAY = {"N": ("N", 1.0), "N·m": ("mN·m", 1e3), "m": ("µm", 1e6)}


def residual_table(estimate: Estimate) -> Html:
    """Return the residuals of every channel (rows) in every experiment (columns)."""
    columns = [
        [_residual_cells(channel) for channel in channel_residuals(fit)] + [_worst_cells(fit)]
        for fit in estimate.fits
    ]
    head = ["channel"]
    for fit in estimate.fits:
        head += [f"{fit.experiment.name}: rms", "rms, σ", "scatter, σ"]
    names = [*CHANNELS, "worst fiducial"]
    rows = [[name, *chain(*cells)] for name, *cells in zip(names, *columns, strict=True)]
    return page.table("Residuals, measured minus predicted", head, rows)


def _residual_cells(channel: ChannelResidual) -> tuple[str, str, str]:
    unit, factor = _DISPLAY[channel.unit]
    rms = _number(factor * channel.rms, ".3g")
    return f"{rms} {unit}", _number(channel.rms_sigma, ".2f"), _number(channel.scatter_sigma, ".2f")


def _worst_cells(fit: ExperimentFit) -> tuple[str, str, str]:
    worst = worst_fiducial(fit)
    if worst is None:
        return "–", "–", ""
    number, rms_sigma = worst
    unit, factor = _DISPLAY["m"]
    missed = fit.experiment.fiducials[:, number] - fit.fiducials[:, number]
    rms = _number(factor * root_mean_square(missed), ".3g")
    return f"m{number:02d}: {rms} {unit}", _number(rms_sigma, ".2f"), ""


def _number(value: float, form: str) -> str:
    return f"{value:{form}}" if math.isfinite(value) else "–"


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


def fit_facts(estimate: Estimate) -> dict[str, str]:
    """Return the outcome of the fit, and what it took, in words."""
    modulus, ratio = estimate.youngs_modulus, estimate.poisson_ratio
    rmse, mesh = estimate.rmse, estimate.mesh.describe()
    return {
        "E": f"{modulus.value / 1e3:.5g} ± {modulus.std / 1e3:.2g} kPa (standard deviation)",
        "ν": f"{ratio.value:.5g} ± {ratio.std:.2g}",
        "correlation of E and ν": f"{estimate.correlation:+.2f}",
        "rmse force": f"{_number(rmse.force, '.3g')} N",
        "rmse torque": f"{_number(1e3 * rmse.torque, '.3g')} mN·m",
        "rmse fiducials": f"{_number(1e6 * rmse.fiducials, '.3g')} µm",
        "residual / noise": f"{estimate.noise_ratio:.3f}",
        "intervals widened": f"{estimate.inflation:.3f} times",
        "mesh": f"{mesh['elements']} elements {mesh['kind']}, {mesh['nodes']} nodes",
        "change on the finer mesh": f"{estimate.discretisation_force:.2g} N at most, corrected for",
        "iterations": str(len(estimate.iterates) - 1),
        "states solved": str(estimate.forward_solves),
        "wall time": f"{estimate.seconds:.1f} s",
    }


def specimen_facts(experiment: Experiment) -> dict[str, str]:
    """Return what the experiments state about the phantom and how it is held, in words."""
    phantom, environment = experiment.phantom, experiment.environment
    half = MM * np.array(phantom.size_m) / 2
    grasp = np.ptp(within_mm(experiment.grasp.box, np.stack([-half, half])), axis=0)
    return {
        "phantom": experiment.phantom_id,
        "shape": phantom.shape,
        "size": _lengths(2 * half),
        "density": f"{phantom.density:g} kg/m³",
        "anchors": str(len(experiment.anchors)),
        "grasp": _lengths(grasp),
        "fiducials": str(len(experiment.fiducials_rest)),
        "lies on": environment.surface_below,
        "gravity": ", ".join(f"{g:g}" for g in environment.gravity) + " m/s²",
    }


def _lengths(edges_mm: NDArray[np.float64]) -> str:
    return " × ".join(f"{edge:.4g}" for edge in edges_mm) + " mm"
