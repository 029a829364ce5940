"""An effect that acts on a simulated phantom, and how a person writes it down.

    LABEL[:FORM][=VALUE][,NAME=VALUE...]

The bare value is that of the effect's first amplitude; without any, it acts at its usual size. Amplitudes that are not
named are zero, constants that are not named stand in the middle of their usual places; those that have none must be
named.
"""

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass

from estimator.effects.catalogue import Catalogue, default_catalogue
from estimator.effects.effect import Amplitude, Constant, Effect
from estimator.errors import InputError


@dataclass(frozen=True)
class ActingEffect:
    """An effect with values of all its parameters."""

    effect: Effect
    values: Mapping[str, float]


def read_effect(text: str, catalogue: Catalogue | None = None) -> ActingEffect:
    """Read an effect as it is written in the module's text, of the default catalogue where none is given.

    Raises
    ------
    InputError
        Label, form or parameter is unknown, a value is no number or out of its range, or a constant is missing.
    """
    items = [item.strip() for item in text.split(",")]
    name, equals, bare = items[0].partition("=")
    effect = _effect_named(name.strip(), catalogue or default_catalogue())
    first = bare.strip() if equals else ""
    named = [item for item in [first, *items[1:]] if "=" in item]
    given = dict(_parameter(effect, item) for item in named)
    if "=" not in first:
        leading = effect.amplitudes[0]
        given.setdefault(leading.name, _number(effect, leading.name, first) if first else leading.scale)
    if odd := [item for item in items[1:] if "=" not in item]:
        raise InputError(f"effect {effect.name}: '{odd[0]}' has no name; write NAME=VALUE; {takes(effect)}")
    return acting_effect(effect, given)


def acting_effect(effect: Effect, given: Mapping[str, float]) -> ActingEffect:
    """Return an effect with the values that are given, and for its other parameters those of the module's text.

    Raises
    ------
    InputError
        A parameter is unknown, its value out of its range, or a constant is missing.
    """
    for name in given:
        _check_known(effect, name)
    values = {amplitude.name: given.get(amplitude.name, 0.0) for amplitude in effect.amplitudes}
    values |= {constant.name: _constant(effect, constant, given) for constant in effect.constants}
    for parameter in _parameters(effect):
        _check_range(effect, parameter, values[parameter.name])
    return ActingEffect(effect, values)


def takes(effect: Effect) -> str:
    """Return the parameters of an effect with their units and usual sizes, in words."""
    amplitudes = [f"{a.name} ({_unit(a.unit)}usually {a.scale:g})" for a in effect.amplitudes]
    constants = [f"{c.name} ({_unit(c.unit)}{_usual(c)})" for c in effect.constants]
    return f"it takes {', '.join([*amplitudes, *constants])}"


def catalogue_text(catalogue: Catalogue | None = None) -> str:
    """Return every effect with its parameters, a line each, of the default catalogue where none is given."""
    return "\n".join(
        f"{effect.name}: {takes(effect)}" for effect in (catalogue or default_catalogue()).effects
    )


def _parameters(effect: Effect) -> list[Amplitude | Constant]:
    return [*effect.amplitudes, *effect.constants]


def _effect_named(name: str, catalogue: Catalogue) -> Effect:
    label, _, form = name.partition(":")
    alike, labels = catalogue.forms(label), catalogue.labels
    if not alike:
        near = difflib.get_close_matches(label, labels, n=3)
        near += [known for known in labels if label and label in known and known not in near]
        hint = f"; did you mean {' or '.join(near)}" if near else ""
        raise InputError(f"no effect is called '{label}'{hint}; the effects are {', '.join(labels)}")
    if not form:
        return alike[0]
    for effect in alike:
        if effect.form == form:
            return effect
    forms = ", ".join(effect.form for effect in alike if effect.form) or "none"
    raise InputError(f"effect {label} has no form '{form}'; it has {forms}")


def _parameter(effect: Effect, item: str) -> tuple[str, float]:
    name, _, value = (part.strip() for part in item.partition("="))
    _check_known(effect, name)
    return name, _number(effect, name, value)


def _check_known(effect: Effect, name: str) -> None:
    if name not in {parameter.name for parameter in _parameters(effect)}:
        raise InputError(f"effect {effect.name} has no parameter '{name}'; {takes(effect)}")


def _number(effect: Effect, name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"effect {effect.name}: {name} = '{text}' is no finite number; {takes(effect)}")
    return value


def _constant(effect: Effect, constant: Constant, given: Mapping[str, float]) -> float:
    if constant.name in given:
        return given[constant.name]
    if not constant.grid:
        raise InputError(f"effect {effect.name} needs {constant.name}=VALUE; {takes(effect)}")
    return constant.grid[len(constant.grid) // 2]


def _check_range(effect: Effect, parameter: Amplitude | Constant, value: float) -> None:
    if not parameter.lower <= value <= parameter.upper:
        raise InputError(
            f"effect {effect.name}: {parameter.name} = {value:g} is outside "
            f"[{parameter.lower:g}, {parameter.upper:g}]{_unit(f' {parameter.unit}').rstrip(', ')}"
        )


def _unit(unit: str) -> str:
    return "" if unit.strip() == "1" else f"{unit}, "


def _usual(constant: Constant) -> str:
    return f"usually {constant.grid[len(constant.grid) // 2]:g}" if constant.grid else "to be named"
