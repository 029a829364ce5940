"""What was found of a phantom and its rig, as it is handed over: the material, and every answer with its causes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from estimator.diagnosis.result import Quantity
from estimator.effects.effect import Effect


@dataclass(frozen=True)
class Cause:
    """An effect of the rig or the tissue with its parameters and their standard deviations, by name."""

    effect: Effect
    values: Mapping[str, float]
    deviations: Mapping[str, float]


@dataclass(frozen=True)
class Tissue:
    """E (Pa) and ν with their standard deviations, and the correlation of the two."""

    youngs_modulus: Quantity
    poisson_ratio: Quantity
    correlation: float = 0.0


@dataclass(frozen=True)
class Answer:
    """One answer to what the cause is.

    Attributes
    ----------
    label : of the leading cause, "none" or "unknown"
    probability : that it is the answer
    causes : what acts then; none where nothing does, or where nobody knows what
    tissue : E and ν beside them
    """

    label: str
    probability: float
    causes: tuple[Cause, ...]
    tissue: Tissue


@dataclass(frozen=True)
class Found:
    """What an estimation or a diagnosis has found.

    Attributes
    ----------
    law, shape : of the tissue, the shape parameters in the law's order
    answers : the first is the verdict, which is handed over; draws are of all
    notes : what could not be taken from the result, a sentence each
    """

    law: str
    shape: tuple[float, ...]
    answers: tuple[Answer, ...]
    notes: tuple[str, ...] = ()

    @property
    def verdict(self) -> Answer:
        """The answer that is handed over."""
        return self.answers[0]
