"""Read what was found from the JSON of ``retract estimate --json`` or ``retract diagnose --json``."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from estimator.diagnosis.result import Quantity
from estimator.effects.catalogue import Catalogue, default_catalogue
from estimator.effects.effect import OUTSIDE, Effect
from estimator.errors import InputError
from estimator.handover.found import Answer, Cause, Found, Tissue
from estimator.materials import law_named
from estimator.simulation.acting import acting_effect

# Answers that are less probable are not drawn: hardly one in a hundred simulators would have them.
_LEAST_PROBABILITY = 0.01
_NONE = "none"


def read_found(path: Path, catalogue: Catalogue | None = None) -> Found:
    """Read a result.

    Raises
    ------
    InputError
        The file is no such result, or lacks what a handover needs.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(f"{path}: cannot be read as JSON ({error})") from error
    try:
        return found_of(data, catalogue)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{path}: is no whole result of an estimation or a diagnosis (at {error}); write one by "
            "retract estimate --json or retract diagnose --output"
        ) from error


def found_of(data: Mapping[str, Any], catalogue: Catalogue | None = None) -> Found:
    """Return what a result holds.

    Raises
    ------
    InputError
        It is no such result, or was made with a law whose shape it does not tell.
    """
    if isinstance(data, dict) and "material" in data and "verdict" in data:
        return _of_diagnosis(data, catalogue or default_catalogue())
    if isinstance(data, dict) and "youngs_modulus" in data and "law" in data:
        return _of_estimate(data)
    raise InputError(
        "is no result of an estimation or a diagnosis: it has neither youngs_modulus and law, nor material and "
        "verdict; write one by retract estimate --json or retract diagnose --output"
    )


def _of_estimate(data: Mapping[str, Any]) -> Found:
    law = law_named(data["law"])
    shape = tuple(float(data["shape"][one.name]["value"]) for one in law.shape_parameters)
    tissue = Tissue(
        _quantity(data["youngs_modulus"], "Pa"),
        _quantity(data["poisson_ratio"], "1"),
        float(data.get("correlation", 0.0)),
    )
    return Found(law.name, shape, (Answer(_NONE, 1.0, (), tissue),))


def _of_diagnosis(data: Mapping[str, Any], catalogue: Catalogue) -> Found:
    law = law_named(data.get("law", "neo_hookean"))
    if law.shape_parameters:
        raise InputError(
            f"was made with the law {law.name}, whose shape a diagnosis does not tell; hand over an estimate with it"
        )
    notes: list[str] = []
    before, after = (_tissue(data["material"][when]) for when in ("before", "after"))
    verdict = list(data["verdict"])
    probabilities = {label: value or 0.0 for label, value in data["probabilities"].items()}
    leading = verdict[0] if verdict else _NONE
    named = tuple(
        cause for label in verdict if (cause := _cause(label, data["effects"], catalogue, notes)) is not None
    )
    answers = [Answer(leading, probabilities.get(leading, 1.0), named, after if verdict else before)]
    for label, probability in sorted(probabilities.items(), key=lambda one: -one[1]):
        if label == leading or probability < _LEAST_PROBABILITY:
            continue
        if label in (_NONE, OUTSIDE):
            answers.append(Answer(label, probability, (), before if label == _NONE else after))
            continue
        alone = data["effects"].get(label, {}).get("alone")
        cause = _cause(label, {label: {**data["effects"].get(label, {}), **(alone or {})}}, catalogue, notes)
        if cause is not None:
            tissue = _tissue(alone["material"]) if alone else after
            answers.append(Answer(label, probability, (cause,), tissue))
    return Found(law.name, (), tuple(answers), tuple(notes))


def _cause(label: str, effects: Mapping[str, Any], catalogue: Catalogue, notes: list[str]) -> Cause | None:
    """Return an effect of a result, None with a note where it cannot be made of what the result holds."""
    told = effects.get(label) or {}
    parameters: Mapping[str, Any] = told.get("parameters") or {}
    forms = [e for e in (*catalogue.effects, *catalogue.outsiders) if e.label == label]
    effect = next((one for one in forms if _fits(one, told.get("form"), parameters)), None)
    if effect is None:
        notes.append(
            f"{label}: "
            + (
                "has no form that is known, and is left out"
                if label == OUTSIDE
                else "its form or size is not told"
            )
        )
        return None
    values = {name: float(parameters[name]["value"]) for name in parameters}
    deviations = {name: float(parameters[name].get("std") or 0.0) for name in parameters}
    try:
        values = dict(acting_effect(effect, values).values)
    except InputError as error:
        notes.append(f"{label}: {error}")
        return None
    return Cause(effect, values, deviations)


def _fits(effect: Effect, form: str | None, parameters: Mapping[str, Any]) -> bool:
    names = {one.name for one in effect.amplitudes} | {one.name for one in effect.constants}
    return names == set(parameters) and (form is None or effect.form == form)


def _tissue(material: Mapping[str, Any]) -> Tissue:
    return Tissue(_quantity(material["youngs_modulus"], "Pa"), _quantity(material["poisson_ratio"], "1"))


def _quantity(measured: Mapping[str, Any], unit: str) -> Quantity:
    return Quantity(float(measured["value"]), float(measured.get("std") or 0.0), unit)
