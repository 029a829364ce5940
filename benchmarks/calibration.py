"""What each calibrated number of the diagnosis is worth: halved, and doubled, on cases with known answers."""

import argparse
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from estimator.blind.scoring.answers import Answer
from estimator.blind.scoring.diagnoses import read_diagnoses
from estimator.blind.scoring.keys import Key, open_keys
from estimator.blind.scoring.labels import answers_to
from estimator.blind.scoring.metrics import LEAST_PROBABILITY
from estimator.blind.scoring.running import answer_cases
from estimator.diagnosis.declared_numbers import Number
from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.errors import InputError

FACTORS: Mapping[str, float] = {"half": 0.5, "twice": 2.0}
_STATED = "stated"


@dataclass(frozen=True, slots=True)
class Standing:
    """How well some answers agree with the truth.

    Attributes
    ----------
    right : cases of which every cause leads the verdict, and nothing else
    cases : of how many
    log_score : mean logarithm of the probability that the right answer was given, nats; over cases with one answer
    """

    right: int
    cases: int
    log_score: float

    def __str__(self) -> str:
        return f"{self.right} of {self.cases} right, {self.log_score:.3f} nats a case"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what the benchmark needs to know."""
    parser.add_argument("cases", type=Path, metavar="CASES", help="as retract benchmark make has made them")
    parser.add_argument("keys", type=Path, metavar="KEYS", help="their answers; the opening is counted there")
    parser.add_argument(
        "results", type=Path, metavar="RESULTS", help="answers are kept here; a later run goes on"
    )
    parser.add_argument("--only", nargs="+", default=[], metavar="NUMBER", help="like evidence.tempering")
    parser.add_argument(
        "--write", type=Path, metavar="FILE", help="put half and twice into this calibration.toml"
    )


def lines(options: argparse.Namespace) -> Iterator[str]:
    """Give a line for each number, and write the table that holds them where that is asked for."""
    numbers = calibrated_numbers(options.only)
    keys, _ = open_keys(options.keys, "benchmarks calibration")
    stated = _standing(options, keys, _STATED, DiagnosisSettings())
    yield f"as stated: {stated}"
    found: dict[str, dict[str, str]] = {}
    for number in numbers:
        found[number.name] = {}
        for word, factor in FACTORS.items():
            name = f"{number.name}-{word}"
            moved = _standing(options, keys, name, with_number_times(number.name, factor))
            found[number.name][word] = f"{moved}, instead of {stated.right}, {stated.log_score:.3f}"
            yield f"{number.name} = {number.value}, {word}: {moved}"
    if options.write is not None:
        text = options.write.read_text(encoding="utf-8")
        options.write.write_text(with_measured(text, found), encoding="utf-8")
        yield f"written into {options.write}"


def calibrated_numbers(only: Sequence[str] = ()) -> list[Number]:
    """Return the calibrated numbers, or those of them with these names.

    Raises
    ------
    InputError
        A name is none of theirs.
    """
    numbers = {one.name: one for one in DiagnosisSettings().numbers() if one.kind == "calibrated"}
    unknown = [name for name in only if name not in numbers]
    if unknown:
        raise InputError(f"{unknown[0]}: no calibrated number; there are {', '.join(numbers)}")
    return [numbers[name] for name in only or numbers]


def with_number_times(name: str, factor: float) -> DiagnosisSettings:
    """Return the default settings with one number, ``layer.field``, multiplied.

    >>> with_number_times("search.in_doubt", 0.5).search.in_doubt
    0.1
    """
    settings = DiagnosisSettings()
    layer, field = name.split(".")
    numbers = getattr(settings, layer)
    moved = replace(numbers, **{field: factor * getattr(numbers, field)})
    return replace(settings, **{layer: moved})


def standing_of(answers: Mapping[str, Answer], keys: Mapping[str, Key]) -> Standing:
    """Compare answers with the keys that bear the same names."""
    pairs = [(answers[name], key) for name, key in keys.items() if name in answers]
    right = sum(_causes(answer.verdict) == frozenset(key.effects) for answer, key in pairs)
    scores = [
        math.log(
            max(LEAST_PROBABILITY, *(answer.probabilities.get(one, 0.0) for one in answers_to(key.effects)))
        )
        for answer, key in pairs
        if len(key.effects) < 2
    ]
    return Standing(right, len(pairs), sum(scores) / len(scores) if scores else math.nan)


def with_measured(text: str, found: Mapping[str, Mapping[str, str]]) -> str:
    """Return the text of a ``calibration.toml`` with these values of ``half`` and ``twice``, by name of the number."""
    for name, row in found.items():
        for word, measured in row.items():
            pattern = rf'(\["{re.escape(name)}"\]\n(?:(?!\[).*\n)*?{word} = ).*'
            row_found = re.search(pattern, text)
            if row_found is None:
                raise InputError(f'calibration.toml: no row ["{name}"] with {word}; add one')
            text = f'{text[: row_found.start()]}{row_found[1]}"{measured}"{text[row_found.end() :]}'
    return text


def _causes(verdict: Sequence[str]) -> frozenset[str]:
    return frozenset(verdict) - {"none"}


def _standing(
    options: argparse.Namespace, keys: Mapping[str, Key], name: str, settings: DiagnosisSettings
) -> Standing:
    folder = options.results / name
    answer_cases(partial(diagnose, settings=settings), options.cases, folder)
    return standing_of(read_diagnoses(folder), keys)
