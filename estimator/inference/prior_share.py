"""How much of what is known of a parameter its prior gives, and the words for it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.inference.free_parameter import FreeParameter, InternalPrior

FloatArray = NDArray[np.float64]

# From the first of these shares on a prior is worth a mention, from the second on it is most of what is known.
_IN_PART, _MOSTLY = 0.1, 0.5


def prior_shares(data: FloatArray, priors: FloatArray) -> FloatArray:
    """Return how much (p,) of what is known of each parameter its prior gives, from 0 to 1.

    Parameters
    ----------
    data, priors : (p, p) information of the internal variables, from the measurements and from priors
    """
    return np.asarray(np.diag(np.linalg.inv(data + priors)) * np.diag(priors))


def what_rests_on_priors(parameters: Sequence[FreeParameter], shares: Sequence[float]) -> list[str]:
    """Return a sentence for each parameter of whose value its prior is a part.

    ``shares`` are those of :func:`prior_shares`.
    """
    return [
        f"{p.label} rests {'' if share > _MOSTLY else 'in part '}on {_words_of(p)}, which gives "
        f"{100 * share:.0f} % of what is known of it."
        for p, share in zip(parameters, shares, strict=True)
        if share > _IN_PART
    ]


def _words_of(parameter: FreeParameter) -> str:
    if not isinstance(parameter.prior, InternalPrior):
        return "its prior"
    usual = parameter.at(parameter.prior.median)
    low, high = (usual.after(sign * parameter.prior.std).value for sign in (-1.0, 1.0))
    return f"what is usual ({low:.2f} to {high:.2f})"
