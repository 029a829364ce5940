"""What an estimation found, in sentences: for the head of the page and for the terminal."""

import math
from dataclasses import dataclass

import numpy as np

from estimator.fit.parameters import POISSON_RATIO, YOUNGS_MODULUS, FitParameter
from estimator.fit.result import Estimate, ParameterEstimate
from estimator.report.channels import channel_residuals

# The stated noise of a sensor is itself known to some ten per cent.
_EXPLAINED = 1.1
_NEARLY_EXPLAINED = 1.5
# Well beyond what the scatter of a dozen rows reaches by chance.
_CONSPICUOUS_SIGMA = 1.5
_LARGE_DISCRETISATION = 0.02


@dataclass(frozen=True, slots=True)
class Truth:
    """The values that the specimen is known to have: Young's modulus in Pa, Poisson's ratio."""

    youngs_modulus: float
    poisson_ratio: float


def modulus_text(estimate: Estimate) -> str:
    """Return E with its interval, kPa."""
    modulus = estimate.youngs_modulus
    low, high = modulus.interval95
    kilo = ParameterEstimate(modulus.value / 1e3, modulus.std / 1e3, (low / 1e3, high / 1e3))
    return _with_interval("E", kilo, " kPa")


def ratio_text(estimate: Estimate) -> str:
    """Return ν with its interval."""
    return _with_interval("ν", estimate.poisson_ratio, "")


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
    found = []
    if estimate.inflation > _EXPLAINED:
        found.append(
            f"The intervals were widened {estimate.inflation:.2g} times because the residuals exceed the noise. "
            "They do not cover a bias from what the model leaves out."
        )
    if conspicuous := _conspicuous_channels(estimate):
        found.append(f"Residuals that noise does not explain: {conspicuous}.")
    found += _at_bound(YOUNGS_MODULUS, "E", estimate.youngs_modulus)
    found += _at_bound(POISSON_RATIO, "ν", estimate.poisson_ratio)
    largest = max(float(np.abs(fit.wrench[:, :3]).max()) for fit in estimate.fits)
    if estimate.discretisation_force > _LARGE_DISCRETISATION * largest:
        found.append(
            f"A finer mesh changes a force by {estimate.discretisation_force:.2g} N, which is "
            f"{100 * estimate.discretisation_force / largest:.2g} % of the largest. The values are corrected for "
            "it, but the mesh is coarse for this experiment."
        )
    return found


def summary_text(estimate: Estimate, truth: Truth | None) -> str:
    """Return the findings as a few lines for the terminal."""
    lines = [modulus_text(estimate), ratio_text(estimate), verdict(estimate)]
    if truth is not None:
        lines.append(comparison(estimate, truth))
    lines += [f"Warning: {caveat}" for caveat in caveats(estimate)]
    lines.append(
        f"{len(estimate.iterates) - 1} iterations, {estimate.forward_solves} states solved, "
        f"{estimate.seconds:.1f} s"
    )
    return "\n".join(lines)


def _with_interval(symbol: str, estimate: ParameterEstimate, unit: str) -> str:
    decimals = min(max(0, 1 - math.floor(math.log10(estimate.std))), 6)
    low, high = estimate.interval95
    return f"{symbol} = {estimate.value:.{decimals}f}{unit} (95 %: {low:.{decimals}f} to {high:.{decimals}f})"


def _standing(estimate: ParameterEstimate, truth: float) -> str:
    low, high = estimate.interval95
    return "within the interval" if low <= truth <= high else "outside the interval"


def _at_bound(parameter: FitParameter, symbol: str, estimate: ParameterEstimate) -> list[str]:
    if parameter.lower < estimate.value < parameter.upper:
        return []
    return [
        f"{symbol} = {estimate.value:.5g} is at the bound of the search: the data want a value beyond it, and its "
        "interval means little."
    ]


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
