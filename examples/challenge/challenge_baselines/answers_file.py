"""Writes answers as docs/challenge.md describes them: retraction-answers/1."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class CaseAnswer:
    """Probabilities by label, E in Pa and ν, and the processor time spent, s."""

    probabilities: Mapping[str, float]
    youngs_modulus: Interval
    poisson_ratio: Interval
    seconds: float


def write_answers(
    cases: Path, about: Mapping[str, object], answers: Mapping[str, CaseAnswer], file: Path
) -> None:
    """Write the answers to the set whose published cases lie in a folder."""
    published = (cases / "keys.sha256").read_text(encoding="utf-8")
    told = {
        "format": "retraction-answers/1",
        "set": hashlib.sha256(published.encode()).hexdigest(),
        "answered": datetime.now(UTC).isoformat(timespec="seconds"),
        "entry": dict(about),
        "answers": {name: _plain(answer) for name, answer in answers.items()},
    }
    file.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def _plain(answer: CaseAnswer) -> dict[str, object]:
    total = sum(answer.probabilities.values())
    return {
        "probabilities": {label: round(p / total, 6) for label, p in answer.probabilities.items()},
        "youngs_modulus": _interval(answer.youngs_modulus),
        "poisson_ratio": _interval(answer.poisson_ratio),
        "seconds": round(answer.seconds, 3),
    }


def _interval(found: Interval) -> dict[str, object]:
    low, high = min(found.low, found.value), max(found.high, found.value)
    return {"value": found.value, "interval95": [low, high]}
