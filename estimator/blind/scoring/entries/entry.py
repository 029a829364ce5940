"""An entry: anyone's answers to every case of a sealed set, read from one file and checked."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from estimator.blind.scoring.answers import Answer, Estimate, credible_set
from estimator.blind.scoring.entries.schema import Fault, place, schema_faults, shown
from estimator.blind.scoring.labels import GROUPS, block_of
from estimator.blind.sealing.commitment import Commitment
from estimator.blind.sealing.openings import instant_of
from estimator.blind.sealing.register import hash_of_answers
from estimator.diagnosis.model.labels import NONE
from estimator.errors import InputError
from estimator.input_file import is_number, parse_json, read_input_text

ANSWERS_FORMAT = "retraction-answers/1"

# Probabilities that were rounded to three places still add up to one within this.
_SUM_TOLERANCE = 2e-3


@dataclass(frozen=True, slots=True)
class Entry:
    """Answers with what is told of them.

    Attributes
    ----------
    name, method : of who or what gave them, for the leaderboard
    set_hash : of the set that they answer
    answered : when
    answers_hash : SHA-256 of the file
    answers : by the name of the case
    """

    name: str
    method: str
    set_hash: str
    answered: datetime
    answers_hash: str
    answers: Mapping[str, Answer]


def read_entry(file: Path) -> Entry:
    """Read a file of answers.

    Raises
    ------
    InputError
        It cannot be read, or something in it is wrong; the first fault is told, and how many there are.
    """
    entry, faults = examine(file)
    if entry is None:
        more = (
            f" (the first of {len(faults)} faults; retract benchmark enter tells all)"
            if len(faults) > 1
            else ""
        )
        raise InputError(f"{file}: {faults[0]}{more}")
    return entry


def examine(file: Path, published: Commitment | None = None) -> tuple[Entry | None, list[Fault]]:
    """Return what a file of answers holds, and all that is wrong with it; no entry where anything is.

    Parameters
    ----------
    published : the commitment of the set, every case of which must be answered; None where it is not at hand

    Raises
    ------
    InputError
        The file is no JSON.
    """
    told = parse_json(read_input_text(file), file)
    faults = [*schema_faults(told), *_odd_numbers(told)]
    if isinstance(told, dict) and isinstance(told.get("answers"), dict):
        spoilt = {fault.where for fault in faults}
        for name, answer in told["answers"].items():
            own = place(["answers", name])
            if not any(where == own or where.startswith((f"{own}.", f"{own}[")) for where in spoilt):
                faults += _inconsistencies(name, answer)
        found = _against(told, published) if published else ()
        faults += [fault for fault in found if fault.where not in spoilt]
    if faults or (faults := list(_unsayable(told))):
        return None, faults
    answers = {name: _answer(answer) for name, answer in told["answers"].items()}
    name, method = (" ".join(told["entry"][word].split()) for word in ("name", "method"))
    answered = datetime.fromisoformat(told["answered"])
    return Entry(name, method, told["set"], answered, hash_of_answers(file), answers), []


def _unsayable(told: Mapping[str, Any]) -> Iterator[Fault]:
    """Give what is wrong with the head of answers that pass the schema."""
    if instant_of(told["answered"]) is None:
        yield Fault("answered", f"{told['answered']!r} is no date and time", "correct it")
    if not told["entry"]["name"].strip():
        yield Fault("entry.name", "is blank", "give the entry a name")


def _odd_numbers(told: object) -> Iterator[Fault]:
    """Give the numbers that no quantity has: NaN, which passes every limit of a schema, infinite and gigantic ones."""
    pending: list[tuple[object, tuple[object, ...]]] = [(told, ())]
    while pending:
        value, path = pending.pop()
        if isinstance(value, dict):
            pending += [(inner, (*path, name)) for name, inner in value.items()]
        elif isinstance(value, list):
            pending += [(inner, (*path, number)) for number, inner in enumerate(value)]
        elif isinstance(value, int | float) and not isinstance(value, bool) and not is_number(value):
            yield Fault(
                place(path), f"{shown(value)} is no quantity", "state a finite number, or leave it out"
            )


def _inconsistencies(name: str, answer: Mapping[str, Any]) -> Iterator[Fault]:
    """Give what no schema can say of an answer that passes it."""
    together = math.fsum(answer["probabilities"].values())
    if abs(together - 1) > _SUM_TOLERANCE:
        yield Fault(
            place(["answers", name, "probabilities"]),
            f"they add up to {together:.4g}",
            "make them add up to 1; what is left belongs to none or unknown",
        )
    if (together := math.fsum(answer.get("blocks", {}).values())) > 1 + _SUM_TOLERANCE:
        yield Fault(
            place(["answers", name, "blocks"]),
            f"they add up to {together:.4g}",
            "make them add up to 1 at most",
        )
    for quantity in ("youngs_modulus", "poisson_ratio"):
        if quantity in answer:
            low, high = answer[quantity]["interval95"]
            if not low <= answer[quantity]["value"] <= high:
                yield Fault(
                    place(["answers", name, quantity, "interval95"]),
                    f"{low:g} to {high:g} does not hold the value {answer[quantity]['value']:g}",
                    "state the lower end, then the upper one, with the value between",
                )


def _against(told: Mapping[str, Any], published: Commitment) -> Iterator[Fault]:
    """Give what makes these no answers to a set."""
    if told.get("set") != published.set_hash:
        yield Fault(
            "set",
            "is not the hash of this set",
            f'write "set": "{published.set_hash}", or answer these cases',
        )
    names = case_names(published)
    for name in names:
        if name not in told["answers"]:
            yield Fault(
                "answers", f"{name} has no answer", "answer every case; who cannot says unknown or none"
            )
    for name in told["answers"]:
        if name not in names:
            yield Fault(place(["answers", name]), "is no case of this set", "take it away")


def case_names(published: Commitment) -> list[str]:
    """Return the names of the cases of a committed set."""
    return sorted(path.rpartition("/")[0] or path.removesuffix(".toml") for path in published.keys)


def _answer(told: Mapping[str, Any]) -> Answer:
    probabilities = {label: float(p) for label, p in told["probabilities"].items()}
    likeliest = max(probabilities, key=lambda label: probabilities[label])
    return Answer(
        verdict=tuple(told.get("verdict", () if likeliest == NONE else (likeliest,))),
        probabilities=probabilities,
        seconds=float(told["seconds"]),
        credible_set=credible_set(probabilities),
        blocks=told.get("blocks", _blocks_of(probabilities)),
        centre=_point(told["place"]) if "place" in told else None,
        youngs_modulus=_estimate(told.get("youngs_modulus")),
        poisson_ratio=_estimate(told.get("poisson_ratio")),
    )


def _blocks_of(probabilities: Mapping[str, float]) -> dict[str, float]:
    """Return the probability of each block as the sum of those of its labels; an unknown cause is nowhere."""
    blocks: dict[str, float] = {}
    for label, probability in probabilities.items():
        if label in GROUPS:
            blocks[block_of(label)] = blocks.get(block_of(label), 0.0) + probability
    return blocks


def _estimate(told: Mapping[str, Any] | None) -> Estimate | None:
    return Estimate(float(told["value"]), *map(float, told["interval95"])) if told else None


def _point(told: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = map(float, told)
    return x, y, z
