"""Marginal likelihood and posterior sample of a model with a few parameters, by a sequential Monte Carlo sampler.

Particles start as draws of the prior and are reweighted, resampled and moved while the likelihood is raised from the
power 0 to 1; the product of the mean weights estimates the marginal likelihood without bias (P. Del Moral, A. Doucet,
A. Jasra, J. R. Stat. Soc. B 68 (2006) 411). It needs neither a single mode nor one that looks normal.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

FloatArray = NDArray[np.float64]

PARTICLES = 1500
_KEPT = 0.5
_MOVES = 8
_OPTIMAL = 2.38


@dataclass(frozen=True, eq=False)
class Sample:
    """What a sampler found: the log marginal likelihood, nats, and draws (n, d) of the posterior."""

    log_evidence: float
    draws: FloatArray


def sample_posterior(
    log_likelihood: Callable[[FloatArray], FloatArray],
    dimension: int,
    random: np.random.Generator,
    particles: int = PARTICLES,
) -> Sample:
    """Return evidence and posterior of parameters whose prior is standard normal, each by itself.

    Parameters
    ----------
    log_likelihood : of parameters (n, d), (n,)
    dimension : d
    random : of the draws
    particles : how many; the evidence scatters by about the root of 20 d over them
    """
    draws = random.normal(size=(particles, dimension))
    level = log_likelihood(draws)
    power, evidence = 0.0, 0.0
    reach = _OPTIMAL / np.sqrt(dimension)
    while power < 1.0:
        after = _next_power(power, level)
        weights = (after - power) * level
        evidence += float(logsumexp(weights) - np.log(particles))
        chosen = _resampled(np.exp(weights - logsumexp(weights)), random)
        draws, level, power = draws[chosen], level[chosen], after
        root = np.linalg.cholesky(np.atleast_2d(np.cov(draws.T)) + 1e-9 * np.eye(dimension))
        for _ in range(_MOVES):
            proposed = draws + reach * random.normal(size=draws.shape) @ root.T
            proposed_level = log_likelihood(proposed)
            gain = power * (proposed_level - level) - 0.5 * np.sum(proposed**2 - draws**2, axis=1)
            taken = np.log(random.uniform(size=particles)) < gain
            draws[taken], level[taken] = proposed[taken], proposed_level[taken]
            reach = float(np.clip(reach * np.exp(taken.mean() - 0.25), 0.05, 2 * _OPTIMAL))
    return Sample(evidence, draws)


def _next_power(power: float, level: FloatArray) -> float:
    """Return the power at which half of the particles still count, or one."""
    low, high = power, 1.0
    if _effective((high - power) * level) >= _KEPT:
        return high
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if _effective((middle - power) * level) >= _KEPT else (low, middle)
    return max(low, power + 1e-6)


def _effective(log_weights: FloatArray) -> float:
    """Return the share of particles that count."""
    return float(np.exp(2 * logsumexp(log_weights) - logsumexp(2 * log_weights)) / len(log_weights))


def _resampled(weights: FloatArray, random: np.random.Generator) -> NDArray[np.int64]:
    """Return numbers of particles, each about as often as its weight says (systematic resampling)."""
    places = (random.uniform() + np.arange(len(weights))) / len(weights)
    return np.minimum(np.searchsorted(np.cumsum(weights), places), len(weights) - 1)
