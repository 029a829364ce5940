"""The diagnosis's answers to a set of cases, one file for each case, as ``retract diagnose --json`` prints them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from estimator.blind.scoring.answers import Answer, Estimate
from estimator.blind.scoring.ceiling import Ceiling
from estimator.errors import InputError
from estimator.inference.normal import Z95
from estimator.input_file import is_number, parse_json, read_input_text


def read_diagnoses(folder: Path) -> dict[str, Answer]:
    """Read every answer in a folder, by the name of its case.

    Raises
    ------
    InputError
        There is none, or one cannot be read.
    """
    files = sorted(folder.glob("*.json"))
    if not files:
        raise InputError(f"{folder}: holds no answer; let retract benchmark run write some")
    return {file.stem: _read_diagnosis(file) for file in files}


def _read_diagnosis(file: Path) -> Answer:
    try:
        return answer_of(parse_json(read_input_text(file), file))
    except InputError as error:
        raise InputError(f"{error}, or remove it and diagnose the case again") from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{file}: is no diagnosis ({error!r}); remove it and diagnose the case again"
        ) from error


def answer_of(told: Mapping[str, Any]) -> Answer:
    """Return the answer of a diagnosis as ``retract diagnose --json`` prints it.

    Raises
    ------
    KeyError, TypeError, ValueError, AttributeError
        It is none.
    """
    blocks = {label: _number(share) for label, share in told["where"]["blocks"].items()}
    centre, closure = told["where"]["centre"], told["gap"]["closure_held_out"]
    before, after = told["material"]["before"], told["material"]["after"]
    return Answer(
        verdict=_labels(told["verdict"]),
        probabilities=_probabilities(told["probabilities"]),
        credible_set=_labels(told["credible_set"]),
        closure=None if closure is None else _number(closure),
        blocks=blocks,
        centre=None if centre is None else _point(centre),
        youngs_modulus=_estimate(after["youngs_modulus"]),
        poisson_ratio=_estimate(after["poisson_ratio"]),
        before=(_number(before["youngs_modulus"]["value"]), _number(before["poisson_ratio"]["value"])),
        seconds=_number(told["seconds"]),
        processor_seconds=_number(told["processor_seconds"]) if "processor_seconds" in told else None,
        ceiling={label: _ceiling(one) for label, one in told.get("ceiling", {}).items()},
    )


def _estimate(told: Mapping[str, Any]) -> Estimate:
    value, reach = _number(told["value"]), Z95 * _number(told["std"])
    return Estimate(value, value - reach, value + reach)


def _ceiling(told: Mapping[str, Any]) -> Ceiling:
    sigma, share = (tuple(map(_number, told[name])) for name in ("sigma", "share"))
    if len(sigma) != len(share) or not sigma:
        raise ValueError("a ceiling has not as many shares as sigma")
    return Ceiling(sigma, share)


def _labels(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(label, str) for label in value):
        raise TypeError("a list of labels is none")
    return tuple(value)


def _probabilities(value: Mapping[str, Any]) -> dict[str, float]:
    probabilities = {label: _number(p) for label, p in value.items()}
    if not probabilities or not all(0 <= p <= 1 + 1e-9 for p in probabilities.values()):
        raise ValueError("the probabilities are none")
    return probabilities


def _point(value: object) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise TypeError("a centre has not three coordinates")
    x, y, z = map(_number, value)
    return x, y, z


def _number(value: object) -> float:
    if not is_number(value):
        raise TypeError("a number is none")
    return float(value)
