"""Draws from what was found, for domain randomisation: E, ν and the parameters of the causes, with weights.

Every answer gets its share of the draws, at least one; the weights of its draws add up to its probability. Parameters
are drawn from normal distributions within their bounds, E and ν with their correlation.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Constant
from estimator.errors import InputError
from estimator.handover.found import Answer, Cause, Found

FloatArray = NDArray[np.float64]

# Nearer to one half few engines find an equilibrium.
_LARGEST_POISSON_RATIO = 0.499
_TRIES = 1000


@dataclass(frozen=True)
class Draw:
    """One draw: its answer, its weight, and its numbers by name, SI units."""

    answer: str
    weight: float
    youngs_modulus: float
    poisson_ratio: float
    parameters: dict[str, float]


def draw(found: Found, count: int, seed: int) -> list[Draw]:
    """Return so many draws; the same seed gives the same.

    Raises
    ------
    InputError
        Fewer are asked for than there are answers.
    """
    answers = found.answers
    if count < len(answers):
        raise InputError(
            f"--draws {count}: there are {len(answers)} answers that are at all probable; ask for as many or more"
        )
    total = sum(answer.probability for answer in answers)
    shares = np.array([answer.probability / total for answer in answers])
    counts = 1 + np.floor(shares * (count - len(answers))).astype(int)
    counts[0] += count - counts.sum()
    random = np.random.default_rng(seed)
    return [
        _one(answer, share / number, random)
        for answer, share, number in zip(answers, shares, counts, strict=True)
        for _ in range(number)
    ]


def _one(answer: Answer, weight: float, random: np.random.Generator) -> Draw:
    tissue = answer.tissue
    mean = np.array([tissue.youngs_modulus.value, tissue.poisson_ratio.value])
    std = np.array([tissue.youngs_modulus.std, tissue.poisson_ratio.std])
    mixed = np.array([[1.0, 0.0], [tissue.correlation, np.sqrt(max(1.0 - tissue.correlation**2, 0.0))]])
    lower, upper = np.array([0.0, -1.0]), np.array([np.inf, _LARGEST_POISSON_RATIO])
    youngs_modulus, poisson_ratio = mean
    for _ in range(_TRIES):
        youngs_modulus, poisson_ratio = mean + std * (mixed @ random.normal(size=2))
        if lower[0] < youngs_modulus < upper[0] and lower[1] < poisson_ratio < upper[1]:
            break
    parameters = {
        f"{cause.effect.name}.{name}": value
        for cause in answer.causes
        for name, value in _parameters(cause, random).items()
    }
    return Draw(
        answer.label,
        weight,
        float(youngs_modulus),
        float(np.clip(poisson_ratio, lower[1], upper[1])),
        parameters,
    )


def _parameters(cause: Cause, random: np.random.Generator) -> dict[str, float]:
    found = {}
    parameters: list[Amplitude | Constant] = [*cause.effect.amplitudes, *cause.effect.constants]
    for one in parameters:
        value = cause.values[one.name] + cause.deviations.get(one.name, 0.0) * random.normal()
        found[one.name] = float(np.clip(value, one.lower, one.upper))
    return found


def write_draws(draws: Sequence[Draw], folder: Path) -> None:
    """Write ``draws.csv``, a row each with empty fields where a parameter does not act, and ``draws.json``."""
    names = sorted({name for one in draws for name in one.parameters})
    with (folder / "draws.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["weight", "answer", "youngs_modulus", "poisson_ratio", *names])
        for one in draws:
            row: list[Any] = [one.weight, one.answer, one.youngs_modulus, one.poisson_ratio]
            table.writerow([*row, *(one.parameters.get(name, "") for name in names)])
    objects = [
        {
            "weight": one.weight,
            "answer": one.answer,
            "youngs_modulus": one.youngs_modulus,
            "poisson_ratio": one.poisson_ratio,
            "parameters": one.parameters,
        }
        for one in draws
    ]
    (folder / "draws.json").write_text(json.dumps(objects, indent=1), encoding="utf-8")
