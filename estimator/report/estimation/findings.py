"""What an estimation found, in sentences: for the head of the page and for the terminal."""

import math
from dataclasses import dataclass

import numpy as np

from estimator.experiment.support import supposed_flat
from estimator.fit.online import OnlineEstimate
from estimator.fit.result import Estimate, ParameterEstimate
from estimator.inference.material_parameters import POISSON_RATIO, YOUNGS_MODULUS
from estimator.report.channels import channel_residuals

# The stated noise of a sensor is itself known to some ten per cent.
_EXPLAINED = 1.1
_NEARLY_EXPLAINED = 1.5
# Well beyond what the scatter of a dozen rows reaches by chance.
_CONSPICUOUS_SIGMA = 1.5
_LARGE_DISCRETISATION = 0.02
SYMBOLS = {parameter.name: parameter.symbol for parameter in (YOUNGS_MODULUS, POISSON_RATIO)}


@dataclass(frozen=True, slots=True)
class Truth:
    """The values that the specimen is known to have: Young's modulus in Pa, Poisson's ratio."""

    youngs_modulus: float
    poisson_ratio: float


def parameter_texts(estimate: Estimate) -> list[str]:
    """Return each parameter of the material with its interval; E in kPa."""
    return [_parameter_text(name, value) for name, value in estimate.parameters.items()]


def step_text(estimate: OnlineEstimate) -> str:
    """Return the parameters after a step of a running retraction."""
    return ", ".join(_parameter_text(name, value) for name, value in estimate.parameters.items())


def _parameter_text(name: str, estimate: ParameterEstimate) -> str:
    if name != YOUNGS_MODULUS.name:
        return _with_interval(SYMBOLS.get(name, name), estimate, "")
    low, high = estimate.interval95
    kilo = ParameterEstimate(estimate.value / 1e3, estimate.std / 1e3, (low / 1e3, high / 1e3))
    return _with_interval("E", kilo, " kPa")


def verdict(estimate: Estimate) -> str:
    """Tell whether the model explains the data."""
    ratio = estimate.noise_ratio
    if ratio <= _EXPLAINED:
        words = "The model explains the data within the sensors' noise"
    elif ratio <= _NEARLY_EXPLAINED:
        words = "The model nearly explains the data"
    else:
        words = "The model does not explain the data"
    return f"{words}: the residuals are {ratio:.2f} times the stated noise."


def comparison(estimate: Estimate, truth: Truth) -> str:
    """Tell how far the estimate is from the truth."""
    modulus, ratio = estimate.youngs_modulus, estimate.poisson_ratio
    relative = 100 * (modulus.value / truth.youngs_modulus - 1)
    return (
        f"Truth: E = {truth.youngs_modulus / 1e3:.5g} kPa (estimate off by {relative:+.2g} %, "
        f"{_standing(modulus, truth.youngs_modulus)}), ν = {truth.poisson_ratio:.5g} (off by "
        f"{ratio.value - truth.poisson_ratio:+.2g}, {_standing(ratio, truth.poisson_ratio)})."
    )


def caveats(estimate: Estimate) -> list[str]:
    """Return what a reader has to know before using the values; empty if there is nothing."""
    found = list(dict.fromkeys(filter(None, (supposed_flat(fit.experiment) for fit in estimate.fits))))
    if estimate.inflation > _EXPLAINED:
        found.append(
            f"The intervals were widened {estimate.inflation:.2g} times because the residuals exceed the noise. "
            "They do not cover a bias from what the model leaves out."
        )
    if conspicuous := _conspicuous_channels(estimate):
        found.append(f"Residuals that noise does not explain: {conspicuous}.")
    found += [
        f"{SYMBOLS.get(name, name)} = {estimate.parameters[name].value:.5g} is at the bound of the search: the data "
        "want a value beyond it, and its interval means little."
        for name in estimate.at_bound
    ]
    if estimate.below_zero:
        found.append(
            f"ν = {estimate.poisson_ratio.value:.3g} is below zero, as of no soft tissue and no elastomer: something "
            "that the model leaves out moves it, or the measurements hardly tell it."
        )
    largest = max(float(np.abs(fit.wrench[:, :3]).max()) for fit in estimate.fits)
    if estimate.discretisation_force > _LARGE_DISCRETISATION * largest:
        found.append(
            f"A finer mesh changes a force by {estimate.discretisation_force:.2g} N, which is "
            f"{100 * estimate.discretisation_force / largest:.2g} % of the largest. The values are corrected for "
            "it, but the mesh is coarse for this experiment."
        )
    return found


def taken_up(estimate: Estimate) -> str:
    """Tell what the nuisances and the loss took up, so that it is not in the residuals; empty where nobody asked."""
    floated = estimate.floated
    if floated is None:
        return ""
    tares = np.abs(np.array(floated.tares)).max(axis=0)
    offsets = float(np.sqrt(np.mean(np.square(floated.rest_offsets)))) if floated.rest_offsets.size else 0.0
    words = [
        f"tares up to {tares[:3].max():.2g} N and {1e3 * tares[3:].max():.2g} mN·m",
        f"rest positions of the fiducials off by {1e6 * offsets:.2g} µm (rms)",
    ]
    if floated.force_gain:
        words.append(f"a force gain of {100 * floated.force_gain:+.2g} %")
    if floated.rejected_share:
        words.append(
            f"{100 * floated.rejected_share:.2g} % of the measurements, which the loss gave little weight"
        )
    correction = [
        f"{SYMBOLS.get(name, name)} by {change:+.2g}{' Pa' if name == 'youngs_modulus' else ''}"
        for name, change in floated.discretisation.items()
    ]
    if any(floated.discretisation.values()):
        words.append(f"the discretisation error, which moved {' and '.join(correction)}")
    return f"Taken up besides: {', '.join(words)}."


def summary_text(estimate: Estimate, truth: Truth | None) -> str:
    """Return the findings as a few lines for the terminal."""
    lines = [*parameter_texts(estimate), verdict(estimate)]
    if truth is not None:
        lines.append(comparison(estimate, truth))
    lines += [f"Warning: {caveat}" for caveat in caveats(estimate)]
    lines += [*estimate.identifiability, *filter(None, [taken_up(estimate)])]
    lines.append(
        f"{len(estimate.iterates) - 1} iterations, {estimate.forward_solves} states solved, "
        f"{estimate.seconds:.1f} s"
    )
    return "\n".join(lines)


def _with_interval(symbol: str, estimate: ParameterEstimate, unit: str) -> str:
    if estimate.std == 0.0:
        return f"{symbol} = {estimate.value:.6g}{unit} (given)"
    decimals = min(max(0, 1 - math.floor(math.log10(estimate.std))), 6)
    low, high = estimate.interval95
    return f"{symbol} = {estimate.value:.{decimals}f}{unit} (95 %: {low:.{decimals}f} to {high:.{decimals}f})"


def _standing(estimate: ParameterEstimate, truth: float) -> str:
    low, high = estimate.interval95
    return "within the interval" if low <= truth <= high else "outside the interval"


def _conspicuous_channels(estimate: Estimate) -> str:
    found = [
        (channel.scatter_sigma, f"{channel.name} of {fit.experiment.name} ({channel.scatter_sigma:.1f} σ)")
        for fit in estimate.fits
        for channel in channel_residuals(fit)
        if channel.scatter_sigma > _CONSPICUOUS_SIGMA
    ]
    found.sort(reverse=True)
    named = [text for _, text in found[:3]]
    return ", ".join(named) + (f" and {len(found) - 3} more" if len(found) > 3 else "")
