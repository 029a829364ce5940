"""E and ν with the uncertainty of the diagnosis itself: every answer would have them a little different.

The variance about the most probable answer's value m is Σ p_j (s_j² + (m_j − m)²) over the answers j with probability
p_j, value m_j and deviation s_j (Hoeting et al., Bayesian model averaging, Stat. Sci. 14, 1999, 382–417, eq. 3).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.result import Material, Quantity


def with_form_left_open(chosen: Material, baseline: Material, share: float) -> Material:
    """Return the material under causes, its deviations widened by what their forms leave open.

    No form is quite that of the tissue: of what a cause changes E and ν by, a share counts as a deviation.

    Parameters
    ----------
    chosen, baseline : with the causes, and without any
    share : of what they are changed by
    """
    return Material(
        _wider(chosen.youngs_modulus, share * _between(chosen, baseline, "youngs_modulus")),
        _wider(chosen.poisson_ratio, share * _between(chosen, baseline, "poisson_ratio")),
    )


def with_cause_left_open(baseline: Material, tried: Sequence[Material]) -> Material:
    """Return the baseline's material, its deviations widened by what an unknown cause may have changed it by.

    That is taken to be what those changed it by that were tried in vain, root mean square; nothing where none was.
    """
    moved = {
        name: float(np.linalg.norm([_between(one, baseline, name) for one in tried]))
        / max(1.0, float(np.sqrt(len(tried))))
        for name in ("youngs_modulus", "poisson_ratio")
    }
    return Material(
        _wider(baseline.youngs_modulus, moved["youngs_modulus"]),
        _wider(baseline.poisson_ratio, moved["poisson_ratio"]),
    )


def _between(one: Material, other: Material, name: str) -> float:
    return float(getattr(one, name).value - getattr(other, name).value)


def _wider(quantity: Quantity, further: float) -> Quantity:
    return replace(quantity, std=float(np.hypot(quantity.std, further)))


def over_answers(
    chosen: Material, others: Mapping[str, Material], probability: Mapping[str, float]
) -> Material:
    """Return the chosen answer's material, its deviations widened by what other answers would have.

    Parameters
    ----------
    chosen : with the causes of the verdict, which also stands for every answer that says nothing of E and ν
    others : of answers other than that
    probability : of every answer
    """
    known = {label: others[label] for label in probability if label in others}
    weights = np.array([probability[label] for label in known])
    return Material(
        _widened(chosen.youngs_modulus, [one.youngs_modulus for one in known.values()], weights),
        _widened(chosen.poisson_ratio, [one.poisson_ratio for one in known.values()], weights),
    )


def _widened(chosen: Quantity, others: list[Quantity], weights: NDArray[np.float64]) -> Quantity:
    squares = np.array([one.std**2 + (one.value - chosen.value) ** 2 for one in others])
    own = max(0.0, 1.0 - float(weights.sum()))
    return replace(chosen, std=float(np.sqrt(own * chosen.std**2 + weights @ squares)))
