"""What the data say of every effect of the catalogue, once the causes are in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.conclusions.multiple_testing import Multiplicity
from estimator.diagnosis.fitting.case import Linearisation
from estimator.diagnosis.model.free_parameters import HypothesisParameter
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.result import EffectFinding, Quantity, State
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.screening import Trial
from estimator.diagnosis.settings import ConclusionSettings
from estimator.effects.effect import Effect
from estimator.inference.bounded_minimum import bounded_minimum
from estimator.inference.free_parameter import FreeParameter, prior_information
from estimator.inference.linear_model import gram_of
from estimator.inference.material_parameters import POISSON_RATIO, YOUNGS_MODULUS

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Sizes:
    """Amplitudes of an effect to first order beside a fit: best value and standard deviation, with E and ν free."""

    names: tuple[str, ...]
    value: FloatArray
    std: FloatArray
    chi2_drop: float


def sizes_beside(fit: Linearisation, trial: Trial) -> Sizes:
    """Return a further effect's amplitudes beside a fit, within their bounds, by its signature at the baseline."""
    free = trial.signature.free_parameters
    gram = gram_of(
        [
            np.column_stack([r, c, z])
            for r, c, z in zip(fit.residual, fit.jacobian, trial.signature.columns, strict=True)
        ]
    )
    inner = 1 + fit.jacobian[0].shape[1]
    nuisance = gram[1:inner, 1:inner] + prior_information(fit.free_parameters)
    cross = gram[inner:, 1:inner]
    schur = gram[inner:, inner:] - cross @ np.linalg.solve(nuisance, cross.T)
    gradient = gram[inner:, 0] - cross @ np.linalg.solve(nuisance, gram[1:inner, 0])
    # Hardly any prior: what the data say is asked for, not what is usual.
    schur = schur + 1e-4 * prior_information(free)
    bounds = np.array([(c.lower, c.upper) for c in free]).T
    value = bounded_minimum(schur, gradient, *bounds)
    drop = float(2.0 * gradient @ value - value @ schur @ value)
    deviations = np.sqrt(np.diag(np.linalg.inv(schur)))
    return Sizes(tuple(c.key for c in free), value, deviations, drop)


def absent_finding(
    trial: Trial,
    fit: Linearisation,
    probability: float,
    multiplicity: Multiplicity,
    settings: ConclusionSettings,
) -> EffectFinding:
    """Return the finding of an effect that the verdict does not name."""
    effect, sizes = trial.signature.effect, sizes_beside(fit, trial)
    amplitudes = {amplitude.name: amplitude for amplitude in effect.amplitudes}
    parameters = {
        name: Quantity(float(value), float(std), amplitudes[name].unit)
        for name, value, std in zip(sizes.names, sizes.value, sizes.std, strict=True)
    }
    relative = [q.std / amplitudes[name].smallest for name, q in parameters.items()]
    would_be_seen = all(settings.mostly_seen * r < 1.0 for r in relative)
    state: State = "absent" if would_be_seen else "cannot_tell"
    if multiplicity.significant(sizes.chi2_drop, len(sizes.names)) and all(
        abs(q.value) < amplitudes[name].smallest for name, q in parameters.items()
    ):
        state = "negligible"
    return EffectFinding(
        effect.label,
        effect.form,
        effect.group,
        effect.words,
        probability,
        state,
        parameters,
        max(sizes.chi2_drop, 0.0),
        None,
        {name: Quantity(settings.seen * q.std, 0.0, q.unit) for name, q in parameters.items()},
    )


def unseen_finding(effect: Effect, probability: float) -> EffectFinding:
    """Return the finding of an effect that acts on nothing that was measured."""
    return EffectFinding(
        effect.label,
        effect.form,
        effect.group,
        effect.words,
        probability,
        "cannot_tell",
        {},
        0.0,
        None,
        {},
    )


def present_finding(
    candidate: Candidate,
    number: int,
    probability: float,
    chi2_drop: float,
    closure: float | None,
    settings: ConclusionSettings,
) -> EffectFinding:
    """Return the finding of a named cause, the ``number``-th effect of a fit."""
    fit = candidate.fit
    effect = fit.hypothesis.effects[number]
    parameters = effect_quantities(fit.hypothesis, fit.free_parameters, candidate.deviations, number)
    amplitudes = {amplitude.name: amplitude for amplitude in effect.amplitudes}
    small = all(abs(parameters[name].value) < a.smallest for name, a in amplitudes.items())
    return EffectFinding(
        effect.label,
        effect.form,
        effect.group,
        effect.words,
        probability,
        "negligible" if small else "present",
        parameters,
        chi2_drop,
        closure,
        {
            name: Quantity(settings.seen * parameters[name].std, 0.0, parameters[name].unit)
            for name in amplitudes
        },
    )


def effect_quantities(
    hypothesis: Hypothesis, free: Sequence[HypothesisParameter], deviations: FloatArray, number: int
) -> dict[str, Quantity]:
    """Return the parameters of the ``number``-th effect of a hypothesis, those that stay fixed last.

    Parameters
    ----------
    free : free_parameters of the hypothesis
    deviations : (p,) standard deviation of the internal variable of each
    """
    found = {
        c.key: _quantity(c.of(hypothesis), float(d))
        for c, d in zip(free, deviations, strict=True)
        if c.effect == number
    }
    fixed = {
        constant.name: Quantity(float(hypothesis.values[number][constant.name]), 0.0, constant.unit)
        for constant in hypothesis.effects[number].constants
        if constant.name not in found
    }
    return {**found, **fixed}


def material_quantities(
    hypothesis: Hypothesis, free: Sequence[HypothesisParameter], deviations: FloatArray
) -> dict[str, Quantity]:
    """Return E and ν of a hypothesis, without a deviation where given; the rest as for :func:`effect_quantities`."""
    given = {
        one.name: Quantity(hypothesis.of_material[one.name], 0.0, one.unit or "1")
        for one in (YOUNGS_MODULUS, POISSON_RATIO)
    }
    fitted = {
        c.name: _quantity(c.of(hypothesis), float(d))
        for c, d in zip(free, deviations, strict=True)
        if c.effect is None
    }
    return {**given, **fitted}


def _quantity(parameter: FreeParameter, deviation: float) -> Quantity:
    """Return a parameter at its value, from the standard deviation of its internal variable."""
    return Quantity(parameter.value, abs(parameter.slope) * deviation, parameter.unit)
