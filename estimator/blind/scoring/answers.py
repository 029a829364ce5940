"""The diagnosis's answers to a set of cases, one file for each case, as ``retract diagnose --json`` prints them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from estimator.blind.scoring.ceiling import Ceiling
from estimator.diagnosis.model.labels import NONE
from estimator.errors import InputError
from estimator.input_file import is_number, parse_json, read_input_text


@dataclass(frozen=True, slots=True)
class Answer:
    """What is scored of one diagnosis.

    Attributes
    ----------
    verdict : labels, the leading one first
    probabilities : of the leading single cause, "none" and "unknown" among them
    credible_set : the smallest set of answers with 90 %
    closure : on held-out experiments; None where it is not known
    block : the likeliest block of the rig
    centre : of a local cause, m
    youngs_modulus, poisson_ratio : before and after the causes are in, Pa and 1
    std : of E and ν after, Pa and 1
    seconds : that it took
    ceiling : by label, how often the best possible test would name it; empty where the answer does not say
    """

    verdict: tuple[str, ...]
    probabilities: Mapping[str, float]
    credible_set: tuple[str, ...]
    closure: float | None
    block: str
    centre: tuple[float, float, float] | None
    youngs_modulus: tuple[float, float]
    poisson_ratio: tuple[float, float]
    std: tuple[float, float]
    seconds: float
    ceiling: Mapping[str, Ceiling]

    @property
    def leading(self) -> str:
        """The first label of the verdict, or "none"."""
        return self.verdict[0] if self.verdict else NONE

    @property
    def ranking(self) -> tuple[str, ...]:
        """The leading answer, then the others by their probability."""
        others = sorted(self.probabilities, key=lambda label: -self.probabilities[label])
        return (self.leading, *(label for label in others if label != self.leading))

    @property
    def likeliest(self) -> tuple[str, float]:
        """The most probable answer and its probability."""
        return max(self.probabilities.items(), key=lambda item: item[1])


def read_answers(folder: Path) -> dict[str, Answer]:
    """Read every answer in a folder, by the name of its case.

    Raises
    ------
    InputError
        There is none, or one cannot be read.
    """
    files = sorted(folder.glob("*.json"))
    if not files:
        raise InputError(f"{folder}: holds no answer; let retract benchmark run write some")
    return {file.stem: _read_answer(file) for file in files}


def _read_answer(file: Path) -> Answer:
    try:
        return answer_from(parse_json(read_input_text(file), file))
    except InputError as error:
        raise InputError(f"{error}, or remove it and diagnose the case again") from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{file}: is no diagnosis ({error!r}); remove it and diagnose the case again"
        ) from error


def answer_from(told: Mapping[str, Any]) -> Answer:
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
        block=max(blocks, key=lambda name: blocks[name]),
        centre=None if centre is None else _point(centre),
        youngs_modulus=(
            _number(before["youngs_modulus"]["value"]),
            _number(after["youngs_modulus"]["value"]),
        ),
        poisson_ratio=(_number(before["poisson_ratio"]["value"]), _number(after["poisson_ratio"]["value"])),
        std=(_number(after["youngs_modulus"]["std"]), _number(after["poisson_ratio"]["std"])),
        seconds=_number(told["seconds"]),
        ceiling={label: _ceiling(one) for label, one in told.get("ceiling", {}).items()},
    )


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
