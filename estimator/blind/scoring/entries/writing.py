"""Writes the diagnosis's own answers to a set as an entry beside those of others."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from estimator.blind.scoring.answers import Answer, Estimate
from estimator.blind.scoring.entries.entry import ANSWERS_FORMAT
from estimator.blind.scoring.entries.schema import answers_schema, labels
from estimator.blind.sealing.commitment import Commitment
from estimator.blind.sealing.openings import now
from estimator.diagnosis.model.labels import UNKNOWN

_LEAST = 1e-6


def write_entry(
    answers: Mapping[str, Answer], published: Commitment, told: Mapping[str, Any], file: Path
) -> None:
    """Write answers as a file of ``retraction-answers/1``.

    Parameters
    ----------
    answers : by the name of the case
    published : the commitment of the set
    told : name, authors and method, as the schema has them under ``entry``
    """
    content = {
        "format": ANSWERS_FORMAT,
        "set": published.set_hash,
        "answered": now(),
        "entry": dict(told),
        "answers": {name: _plain(answer) for name, answer in sorted(answers.items())},
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def _plain(answer: Answer) -> dict[str, Any]:
    """Return an answer as JSON has it; a label of another package's effect is unknown to others."""
    known = set(labels())
    probabilities: dict[str, float] = {}
    for label, probability in answer.probabilities.items():
        word = label if label in known else UNKNOWN
        if probability >= _LEAST:
            probabilities[word] = probabilities.get(word, 0.0) + round(probability, 6)
    plain: dict[str, Any] = {
        "probabilities": probabilities,
        "verdict": list(dict.fromkeys(label if label in known else UNKNOWN for label in answer.verdict)),
        "seconds": answer.seconds if answer.processor_seconds is None else answer.processor_seconds,
    }
    blocks = answers_schema()["$defs"]["block"]["enum"]
    plain["blocks"] = {
        name: round(share, 6) for name, share in answer.blocks.items() if name in blocks and share >= _LEAST
    }
    for quantity, found in (
        ("youngs_modulus", answer.youngs_modulus),
        ("poisson_ratio", answer.poisson_ratio),
    ):
        if found is not None:
            plain[quantity] = _interval(found)
    if answer.centre is not None:
        plain["place"] = list(answer.centre)
    return plain


def _interval(found: Estimate) -> dict[str, Any]:
    return {"value": found.value, "interval95": [found.low, found.high]}
