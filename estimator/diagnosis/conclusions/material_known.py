"""How well E and ν are known that a diagnosis tells: what priors give, and what a value that cannot be means."""

from __future__ import annotations

from collections.abc import Mapping

from estimator.diagnosis.evidence.discrepancy import ModelError, forgiven, moments_of
from estimator.diagnosis.fitting.case import Linearisation
from estimator.inference.free_parameter import prior_information
from estimator.inference.material_parameters import POISSON_RATIO
from estimator.inference.prior_share import prior_shares, what_rests_on_priors

# The stated noise of a sensor is itself known to some ten per cent.
_STANDS_OUT = 1.1


def prior_shares_of_material(fit: Linearisation, error: ModelError) -> dict[str, float]:
    """Return how much of what is known of E and ν their priors give, from 0 to 1; without what was given."""
    gram, _ = forgiven(error, moments_of(error, fit.jacobian), error.floor)
    shares = prior_shares(gram, prior_information(fit.free_parameters))
    return {c.name: float(s) for c, s in zip(fit.free_parameters, shares, strict=True) if c.effect is None}


def material_at_bound(fit: Linearisation) -> tuple[str, ...]:
    """Return the names of E and ν where they stand at a bound."""
    of_material = [c for c in fit.free_parameters if c.effect is None]
    return tuple(c.name for c in of_material if not c.lower < c.value < c.upper)


def what_is_doubtful_of_material(fit: Linearisation, shares: Mapping[str, float], misfit: float) -> list[str]:
    """Return a sentence for each thing that makes E and ν less than a measurement.

    Parameters
    ----------
    fit : whose E and ν are told
    shares : those of :func:`prior_shares_of_material`
    misfit : of that fit, in units of the noise, 1 where it is no more than that
    """
    told = [c for c in fit.free_parameters if c.name in shares]
    found = what_rests_on_priors(told, [shares[c.name] for c in told])
    at_bound = material_at_bound(fit)
    found += [
        f"{c.label} = {c.value:.5g} stands at a bound of the search: the data want one beyond it, or do not tell it."
        for c in told
        if c.name in at_bound
    ]
    found += [
        f"{c.label} = {c.value:.3g} is below zero, as of no soft tissue and no elastomer: something moves it that is "
        "not in the model, or the data hardly tell it."
        for c in told
        if c.name == POISSON_RATIO.name and c.value < 0
    ]
    if misfit > _STANDS_OUT:
        found.append(
            f"The misfit that is left is {misfit:.2g} times the noise; E and ν are told as much less surely for it."
        )
    return found
