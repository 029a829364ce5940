"""The diagnosis's answers to a set of cases, one file for each case, as ``retract diagnose --json`` prints them."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from estimator.diagnosis.result import NONE
from estimator.errors import InputError


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
    seconds : that it took
    """

    verdict: tuple[str, ...]
    probabilities: Mapping[str, float]
    credible_set: tuple[str, ...]
    closure: float | None
    block: str
    centre: tuple[float, float, float] | None
    youngs_modulus: tuple[float, float]
    poisson_ratio: tuple[float, float]
    seconds: float

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
        return _answer(json.loads(file.read_text(encoding="utf-8")))
    except json.JSONDecodeError as error:
        raise InputError(f"{file}: {error}; remove it and diagnose the case again") from error
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{file}: is no diagnosis ({error!r}); remove it and diagnose the case again"
        ) from error


def _answer(told: Mapping[str, Any]) -> Answer:
    blocks = told["where"]["blocks"]
    centre = told["where"]["centre"]
    before, after = told["material"]["before"], told["material"]["after"]
    return Answer(
        verdict=tuple(told["verdict"]),
        probabilities={label: float(p) for label, p in told["probabilities"].items()},
        credible_set=tuple(told["credible_set"]),
        closure=told["gap"]["closure_held_out"],
        block=max(blocks, key=lambda name: blocks[name]),
        centre=None if centre is None else tuple(centre),
        youngs_modulus=(before["youngs_modulus"]["value"], after["youngs_modulus"]["value"]),
        poisson_ratio=(before["poisson_ratio"]["value"], after["poisson_ratio"]["value"]),
        seconds=told["seconds"],
    )
