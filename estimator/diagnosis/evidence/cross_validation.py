"""What is missed of experiments that were left out of the fit.

Parameters fitted to all experiments but one follow from the linearisation at the fit to all, one small solve each; the
misfit of the one left out is predicted with them, by the same linearisation or, where they move it by much, in full.
Of what befell one experiment alone, a bead that was taken for another one or a grip that slid once, the others say
nothing: there alternate stretches of its rows are left out in turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.marginal_likelihood import priors_of
from estimator.diagnosis.fitting.case import Case, Linearisation, residuals_near
from estimator.diagnosis.model.free_parameters import moved
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.settings import EvidenceSettings
from estimator.errors import SolverError
from estimator.inference.bounded_minimum import bounded_minimum
from estimator.inference.laplace import Priors
from estimator.inference.linear_model import chi2_of, negative_log_posterior, stacked

FloatArray = NDArray[np.float64]

# Of the information of all experiments, where the others have none: it is to have an inverse.
_NEXT_TO_NONE = 1e-12


def held_out_residuals(fit: Linearisation, settings: EvidenceSettings) -> list[FloatArray]:
    """Return the whitened residual (r,) of each experiment under a fit to the others.

    Where those leave its prediction open, alternate stretches of its own rows are left out instead; where there is one
    experiment, its last third of rows.
    """
    if len(fit.residual) == 1:
        return [_last_third(fit, _priors(fit, settings))]
    left_open = _left_open(fit, settings)
    return [
        _by_stretches(fit, number, settings) if number in left_open else r - columns @ step
        for number, (r, columns, step) in enumerate(
            zip(fit.residual, fit.jacobian, _steps_without_each(fit, settings), strict=True)
        )
    ]


def held_out_in_full(case: Case, fit: Linearisation, executor: Executor) -> list[FloatArray]:
    """Return the same with every prediction solved in full that a fit to the others moves by much.

    Where one experiment alone tells a parameter, the others seem to leave it far from where the fit to all has it,
    beyond what a derivative there foretells: the step is shortened until the others are fitted better by it.
    """
    settings = case.settings.evidence
    extrapolated = held_out_residuals(fit, settings)
    if len(fit.residual) == 1:
        return extrapolated
    left_open = _left_open(fit, settings)
    jobs = {
        number: executor.submit(_left_out, case, fit, step, number)
        for number, step in enumerate(_steps_without_each(fit, settings))
        if number not in left_open
        and np.sqrt(np.mean((fit.jacobian[number] @ step) ** 2)) > settings.moved_by_much
    }
    return [
        jobs[number].result() if number in jobs else residual for number, residual in enumerate(extrapolated)
    ]


def _left_out(case: Case, fit: Linearisation, step: FloatArray, number: int) -> FloatArray:
    """Return the misfit of one experiment after a step that fits the others better; at the fit to all if none does."""
    before = _misfit_of_others(fit, fit.hypothesis, fit.residual, number)
    for _ in range(case.settings.evidence.shortenings):
        hypothesis = moved(fit.hypothesis, fit.free_parameters, step)
        step = step / 3
        try:
            found = residuals_near(case, hypothesis, fit)
        except SolverError:
            continue
        if _misfit_of_others(fit, hypothesis, found, number) < before:
            return found[number]
    return fit.residual[number]


def _misfit_of_others(
    fit: Linearisation, hypothesis: Hypothesis, residual: Sequence[FloatArray], number: int
) -> float:
    others = chi2_of([r for n, r in enumerate(residual) if n != number])
    return negative_log_posterior(others, [c.of(hypothesis) for c in fit.free_parameters])


def _priors(fit: Linearisation, settings: EvidenceSettings) -> Priors:
    return priors_of(fit.free_parameters, settings)


def _steps_without_each(fit: Linearisation, settings: EvidenceSettings) -> list[FloatArray]:
    """Return for each experiment the step (p,) to the fit to all others."""
    priors, grams = _priors(fit, settings), _grams(fit)
    total = np.sum(grams, axis=0)
    return [_step(total - gram, priors) for gram in grams]


def _left_open(fit: Linearisation, settings: EvidenceSettings) -> set[int]:
    """Return the experiments whose prediction the others leave open by as much as would move it by much."""
    priors, grams = _priors(fit, settings), _grams(fit)
    total = np.sum(grams, axis=0)
    prior = np.diag(priors.inverse_scale**2)
    return {
        number
        for number, (gram, r) in enumerate(zip(grams, fit.residual, strict=True))
        if np.trace(np.linalg.solve(_of_others(total, gram) + prior, gram[1:, 1:]))
        > settings.moved_by_much**2 * len(r)
    }


def _by_stretches(fit: Linearisation, number: int, settings: EvidenceSettings) -> FloatArray:
    """Return the residual (r,) of an experiment whose alternate stretches are left out of the fit in turn."""
    priors, grams = _priors(fit, settings), _grams(fit)
    others = np.sum([gram for n, gram in enumerate(grams) if n != number], axis=0)
    r, columns = fit.residual[number], fit.jacobian[number]
    odd = np.arange(len(r)) * settings.stretches // len(r) % 2 == 1
    found = np.empty_like(r)
    for left_out in (odd, ~odd):
        kept = np.column_stack([r, columns])[~left_out]
        step = _step(others + kept.T @ kept, priors)
        found[left_out] = r[left_out] - columns[left_out] @ step
    return found


def _grams(fit: Linearisation) -> list[FloatArray]:
    """Return for each experiment the Gram matrix (1 + p)² of residual and derivatives."""
    return [block.T @ block for block in stacked(fit)]


def lost_on_held_out(fit: Linearisation, baseline: Linearisation, settings: EvidenceSettings) -> float:
    """Return what the log density of experiments left out of the fit falls by under a hypothesis, against the baseline.

    It is 0 where that grows, or where there is one experiment. A cause that shows in one experiment alone neither gains
    nor loses there; one that others have to speak against is no cause.
    """
    some = (baseline, fit) if len(fit.residual) > 1 else ()
    densities = [_log_density_of_left_out(one, settings) for one in some] or [0.0, 0.0]
    return max(0.0, densities[0] - densities[1])


def _log_density_of_left_out(fit: Linearisation, settings: EvidenceSettings) -> float:
    """Return the sum over experiments of ln p(one | the others), up to a constant.

    What the others leave open of the parameters counts as a further variance of the prediction, Z A⁻¹ Zᵀ with A the
    information of the others: a parameter that only one experiment sees is not held against it.
    """
    priors, grams = _priors(fit, settings), _grams(fit)
    total, density = np.sum(grams, axis=0), 0.0
    for r, columns, gram in zip(fit.residual, fit.jacobian, grams, strict=True):
        others = _of_others(total, gram) + np.diag(priors.inverse_scale**2)
        left = r - columns @ _step(total - gram, priors)
        joint, along = others + gram[1:, 1:], columns.T @ left
        misfit = float(left @ left - along @ np.linalg.solve(joint, along))
        density -= 0.5 * (misfit + np.linalg.slogdet(joint)[1] - np.linalg.slogdet(others)[1])
    return density


def _of_others(total: FloatArray, own: FloatArray) -> FloatArray:
    """Return the information (p, p) of all experiments but one; of what that one alone sees next to none."""
    return np.asarray((total - own)[1:, 1:] + _NEXT_TO_NONE * np.diag(np.diag(total)[1:]))


def _last_third(fit: Linearisation, priors: Priors) -> FloatArray:
    r, columns = fit.residual[0], fit.jacobian[0]
    kept = 2 * len(r) // 3
    first = stacked(fit)[0][:kept]
    return np.asarray((r - columns @ _step(first.T @ first, priors))[kept:])


def _step(gram: FloatArray, priors: Priors) -> FloatArray:
    inverse = priors.inverse_scale
    posterior = gram[1:, 1:] + np.diag(inverse**2)
    return bounded_minimum(posterior, gram[1:, 0] - inverse * priors.centre, priors.lower, priors.upper)
