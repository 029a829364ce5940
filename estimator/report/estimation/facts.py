"""What an estimation came to and what it was made from, in words and numbers with units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.experiment.support import stays_flat
from estimator.fit.result import Estimate, ExperimentFit
from estimator.fit.search import Iterate
from estimator.report.channels import channel_residuals, root_mean_square, worst_fiducial
from estimator.report.drawing.scene import MM, within_mm

# The units that people read, and how many of them make the SI unit.
_DISPLAY = {"N": ("N", 1.0), "N·m": ("mN·m", 1e3), "m": ("µm", 1e6)}

# Within a stage the fit accepts no step that raises the misfit by more than rounding errors.
_RISE = 1.01


@dataclass(frozen=True, slots=True)
class ResidualRow:
    """Measured minus predicted of one channel: its root mean square with unit, in σ, and without its mean in σ."""

    channel: str
    texts: tuple[str, str, str]


def residual_rows(fit: ExperimentFit) -> list[ResidualRow]:
    """Return the residuals of every channel of an experiment, and of the fiducial that is missed most."""
    rows = []
    for channel in channel_residuals(fit):
        unit, factor = _DISPLAY[channel.unit]
        rms = f"{number_text(factor * channel.rms, '.3g')} {unit}"
        texts = rms, number_text(channel.rms_sigma, ".2f"), number_text(channel.scatter_sigma, ".2f")
        rows.append(ResidualRow(channel.name, texts))
    return [*rows, ResidualRow("worst fiducial", _worst_texts(fit))]


def _worst_texts(fit: ExperimentFit) -> tuple[str, str, str]:
    worst = worst_fiducial(fit)
    if worst is None:
        return "–", "–", ""
    number, rms_sigma = worst
    unit, factor = _DISPLAY["m"]
    missed = fit.experiment.fiducials[:, number] - fit.fiducials[:, number]
    rms = number_text(factor * root_mean_square(missed), ".3g")
    return f"m{number:02d}: {rms} {unit}", number_text(rms_sigma, ".2f"), ""


def stage_starts(iterates: Sequence[Iterate]) -> list[int]:
    """Return where the misfit rises, which it does only where more measurements come in, and both ends."""
    rises = [n for n in range(1, len(iterates)) if iterates[n].chi2 > iterates[n - 1].chi2 * _RISE]
    return [0, *rises, len(iterates)]


def fit_facts(estimate: Estimate) -> dict[str, str]:
    """Return the outcome of the fit, and what it took, in words."""
    modulus, ratio = estimate.youngs_modulus, estimate.poisson_ratio
    rmse, mesh = estimate.rmse, estimate.mesh.describe()
    return {
        "E": f"{modulus.value / 1e3:.5g} ± {modulus.std / 1e3:.2g} kPa (standard deviation)",
        "ν": f"{ratio.value:.5g} ± {ratio.std:.2g}",
        "law": estimate.law.replace("_", " "),
        "objective": estimate.objective,
        "correlation of E and ν": f"{estimate.correlation:+.2f}",
        "rmse force": f"{number_text(rmse.force, '.3g')} N",
        "rmse torque": f"{number_text(1e3 * rmse.torque, '.3g')} mN·m",
        "rmse fiducials": f"{number_text(1e6 * rmse.fiducials, '.3g')} µm",
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
        **_directed(experiment),
        "grasp": _lengths(grasp),
        "fiducials": str(len(experiment.fiducials_rest)),
        "lies on": environment.surface_below,
        "gravity": ", ".join(f"{g:g}" for g in environment.gravity) + " m/s²",
    }


def _directed(experiment: Experiment) -> dict[str, str]:
    """Return what holds, or leads, the phantom along some axes only."""
    found = {}
    if experiment.rollers:
        found["rollers"] = "; ".join("along " + ", ".join(roller.directions) for roller in experiment.rollers)
    if experiment.prescribed:
        found["boundaries that were measured"] = str(len(experiment.prescribed))
    if experiment.grasp.slides:
        found["grasp moves"] = "along " + ", ".join(experiment.grasp.directions)
    if stays_flat(experiment):
        found["sheet"] = "stays in its plane"
    return found


def _lengths(edges_mm: NDArray[np.float64]) -> str:
    return " × ".join(f"{edge:.4g}" for edge in edges_mm) + " mm"


def number_text(value: float, form: str) -> str:
    """Return a formatted number; a dash for one that is not known."""
    return f"{value:{form}}" if math.isfinite(value) else "–"
