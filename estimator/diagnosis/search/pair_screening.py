"""Two causes at once, to first order: together they may explain what neither of them alone seems to.

A single effect that takes a little of both leads where two are present, and what it leaves points to neither. So all
pairs of signatures are weighed together. They are many and their inner products known, so that each takes a small
solve: with prior deviations T, the effects' own Gram matrix A and inner products b with the misfit, both with E and ν
projected out, the log evidence is ½ bᵀT (1 + T A T)⁻¹ T b − ½ ln det(1 + T A T), for one size of all effects. The few
best are then weighed in full.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import Moments, forgiven
from estimator.diagnosis.evidence.floors import over_floors
from estimator.diagnosis.evidence.marginal_likelihood import price_of_choice, priors_of
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.model.free_parameters import moved
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.screening import Trial, moments_beside, null_beside
from estimator.inference.free_parameter import prior_information
from estimator.inference.gauss_newton import step_of_gram

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Start:
    """Where a refit with two causes should begin.

    Attributes
    ----------
    log_evidence : that it may reach, to first order
    hypothesis : with both effects, at the sizes that first order gives them
    """

    log_evidence: float
    hypothesis: Hypothesis

    @property
    def labels(self) -> frozenset[str]:
        """Labels of both."""
        return frozenset(effect.label for effect in self.hypothesis.effects)


def likeliest_pairs(context: Context, trials: Sequence[Trial]) -> list[Start]:
    """Return the best pair of every two forms beside a solved hypothesis, the most probable first."""
    case, base, settings = context.case, context.baseline, context.settings.search
    signatures = [trial.signature for trial in trials]
    moments = moments_beside(context, signatures)
    own = 1 + len(base.free_parameters)
    ends = own + np.cumsum([len(one.free_parameters) for one in signatures])
    columns = [
        list(range(end - len(s.free_parameters), end)) for s, end in zip(signatures, ends, strict=True)
    ]
    prices = [price_of_choice(case, null_beside(base, one)[0]) for one in signatures]
    roughly = _roughly_weighed(_projected(moments, context, signatures, own), signatures, columns, prices)
    best: dict[tuple[str, str], Start] = {}
    for first, second in roughly[: settings.pairs_in_full]:
        both = (signatures[first], signatures[second])
        chosen = [*range(own), *columns[first], *columns[second]]
        pair = _weighed(context, moments.among(chosen), both, prices[first] + prices[second])
        forms = (signatures[first].effect.name, signatures[second].effect.name)
        if forms not in best or pair.log_evidence > best[forms].log_evidence:
            best[forms] = pair
    return sorted(best.values(), key=lambda pair: -pair.log_evidence)


def _projected(moments: Moments, context: Context, signatures: Sequence[Signature], own: int) -> FloatArray:
    """Return the Gram matrix of residual and signatures, these in prior deviations, all else projected out."""
    gram, _ = forgiven(context.error, moments, context.error.floor)
    free = slice(1, own)
    known = prior_information(context.baseline.free_parameters)
    left = gram - gram[:, free] @ np.linalg.solve(gram[free, free] + known, gram[free])
    scale = np.ones(len(gram))
    scale[own:] = [
        context.settings.search.size_of_pairs * c.prior_scale
        for one in signatures
        for c in one.free_parameters
    ]
    return np.asarray(left * np.outer(scale, scale))


def _roughly_weighed(
    gram: FloatArray, signatures: Sequence[Signature], columns: Sequence[list[int]], prices: Sequence[float]
) -> list[tuple[int, int]]:
    """Return the pairs of signatures with different labels, the most probable first."""
    found: list[tuple[float, int, int]] = []
    # The larger block is projected out once for all its partners.
    order = sorted(range(len(signatures)), key=lambda number: -len(columns[number]))
    for place, first in enumerate(order):
        block = columns[first]
        value, beside = _one_projected_out(gram, block)
        for second in order[place + 1 :]:
            if signatures[first].effect.label == signatures[second].effect.label:
                continue
            both = value + _gain(beside, columns[second]) - prices[first] - prices[second]
            found.append((both, first, second))
    found.sort(key=lambda item: -item[0])
    return [(first, second) for _, first, second in found]


def _one_projected_out(gram: FloatArray, block: list[int]) -> tuple[float, FloatArray]:
    """Return what a block's amplitudes gain in log evidence, and the Gram matrix of what they leave."""
    posterior = gram[np.ix_(block, block)] + np.eye(len(block))
    left = gram - gram[:, block] @ np.linalg.solve(posterior, gram[block])
    return _gain(gram, block), left


def _gain(gram: FloatArray, block: list[int]) -> float:
    along = gram[block, 0]
    posterior = gram[np.ix_(block, block)] + np.eye(len(block))
    if len(block) == 1:
        return float(0.5 * along[0] ** 2 / posterior[0, 0] - 0.5 * np.log(posterior[0, 0]))
    return float(0.5 * along @ np.linalg.solve(posterior, along) - 0.5 * np.linalg.slogdet(posterior)[1])


def _weighed(context: Context, moments: Moments, both: tuple[Signature, Signature], price: float) -> Start:
    base, settings = context.baseline, context.settings
    hypothesis, free = null_beside(base, both[0])
    hypothesis, free = null_beside(replace(base, hypothesis=hypothesis, free_parameters=free), both[1])
    value = over_floors(moments, priors_of(free, settings.evidence), context.error) - price
    return Start(value, moved(hypothesis, free, step_of_gram(moments.gram, free).step))
