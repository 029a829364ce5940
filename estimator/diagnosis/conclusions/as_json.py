"""A diagnosis as the object that ``retract diagnose --json`` prints; what is not known is null."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from estimator.diagnosis.result import Consideration, Diagnosis, EffectFinding, Gap, Material, Quantity, Where


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return plain values, ready for :func:`json.dumps`, without NaN or infinity."""
    return {
        "verdict": list(diagnosis.verdict),
        "probabilities": _numbers(diagnosis.probabilities),
        "credible_set": list(diagnosis.credible_set),
        "effects": {
            label: _effect(finding, diagnosis.considered.get(label))
            for label, finding in diagnosis.effects.items()
        },
        "gap": {
            **_gap(diagnosis.gap),
            "by_channel": {name: _gap(gap) for name, gap in diagnosis.by_channel.items()},
            "by_experiment": {name: _gap(gap) for name, gap in diagnosis.by_experiment.items()},
            "at_most": {
                name: {"value": _number(size.value), "unit": size.unit}
                for name, size in diagnosis.gap_at_most.items()
            },
        },
        "where": {"block": diagnosis.where.block if diagnosis.verdict else None, **_where(diagnosis.where)},
        "material": {
            "before": _material(diagnosis.before),
            "after": _material(diagnosis.after),
            "prior_share": _numbers(diagnosis.prior_shares),
            "at_bound": list(diagnosis.at_bound),
        },
        "next_experiment": [
            {
                "manoeuvre": advice.manoeuvre,
                "separates": list(advice.separates),
                "sigma_now": _number(advice.sigma_now),
                "sigma_then": _number(advice.sigma_then),
            }
            for advice in diagnosis.next_experiment
        ],
        "seconds": _number(diagnosis.seconds),
    }


def _effect(finding: EffectFinding, considered: Consideration | None) -> dict[str, Any]:
    alone = considered and (considered.achieved or considered.expected)
    return {
        "state": finding.state,
        "parameters": _parameters(finding.parameters),
        "chi2_drop": _number(finding.chi2_drop),
        "closure_held_out": _number(finding.closure_held_out),
        "form": finding.form,
        "alone": alone
        and {"parameters": _parameters(alone.parameters), "material": _material(alone.material)},
    }


def _parameters(parameters: Mapping[str, Quantity]) -> dict[str, Any]:
    return {name: {**_measured(quantity), "unit": quantity.unit} for name, quantity in parameters.items()}


def _gap(gap: Gap) -> dict[str, Any]:
    return {
        "before": _number(gap.before),
        "after": _number(gap.after),
        "floor": _number(gap.floor),
        "closure_held_out": _number(gap.closure_held_out),
    }


def _where(where: Where) -> dict[str, Any]:
    return {
        "channels": _numbers(where.channels),
        "steps": _numbers(where.steps),
        "blocks": _numbers(where.blocks),
        "centre": _point(where.centre),
        "radius": _number(where.radius),
    }


def _material(material: Material) -> dict[str, Any]:
    return {
        "youngs_modulus": _measured(material.youngs_modulus),
        "poisson_ratio": _measured(material.poisson_ratio),
    }


def _measured(quantity: Quantity) -> dict[str, Any]:
    return {"value": _number(quantity.value), "std": _number(quantity.std)}


def _numbers(values: Mapping[str, float]) -> dict[str, float | None]:
    return {name: _number(value) for name, value in values.items()}


def _point(values: Sequence[float] | None) -> list[float | None] | None:
    return None if values is None else [_number(value) for value in values]


def _number(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None
