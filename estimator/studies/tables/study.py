"""A study: cases in levels of what is varied, in groups, and what the paper gives for them."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimator.studies.running.case import Case, Outcome

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """What the paper gives for a level; None where we do not know it.

    Attributes
    ----------
    change : of the mean E against the truth, a share
    scatter : standard deviation of E over the draws, a share
    seconds : of one estimation
    """

    change: float | None = None
    scatter: float | None = None
    seconds: float | None = None


UNKNOWN = PaperFigure()


@dataclass(frozen=True)
class Level:
    """Cases that differ in nothing but their draw, or one case alone."""

    label: str
    cases: tuple[Case, ...]
    paper: PaperFigure = UNKNOWN


@dataclass(frozen=True)
class Truth:
    """E in Pa and ν of what is estimated."""

    youngs_modulus: float
    poisson_ratio: float


@dataclass(frozen=True)
class Group:
    """Levels that are looked at together; no truth where it is not known."""

    title: str
    levels: tuple[Level, ...]
    truth: Truth | None


@dataclass(frozen=True)
class Study:
    """What is varied, and what is to be known for reading the outcome."""

    name: str
    title: str
    notes: tuple[str, ...]
    groups: tuple[Group, ...]

    @property
    def cases(self) -> list[Case]:
        """All cases, in order."""
        return [case for group in self.groups for level in group.levels for case in level.cases]


@dataclass(frozen=True)
class LevelResult:
    """A level with what its cases found.

    Attributes
    ----------
    youngs_modulus, poisson_ratio, seconds : of the cases that gave a row, (n,)
    failures : why the others gave none
    remarks : of the cases, each once
    """

    level: Level
    youngs_modulus: FloatArray
    poisson_ratio: FloatArray
    seconds: FloatArray
    failures: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class GroupResult:
    """A group with the results of its levels."""

    group: Group
    levels: tuple[LevelResult, ...]


@dataclass(frozen=True)
class StudyResult:
    """A study that was carried out."""

    study: Study
    groups: tuple[GroupResult, ...] = field(default_factory=tuple)


def result_of(study: Study, outcomes: Sequence[Outcome]) -> StudyResult:
    """Sort the outcomes of a study's cases, in their order, into its levels."""
    remaining = iter(outcomes)
    groups = []
    for group in study.groups:
        levels = [_level_result(level, [next(remaining) for _ in level.cases]) for level in group.levels]
        groups.append(GroupResult(group, tuple(levels)))
    return StudyResult(study, tuple(groups))


def _level_result(level: Level, outcomes: Sequence[Outcome]) -> LevelResult:
    rows = [outcome.row for outcome in outcomes if outcome.row is not None]

    def column(name: str) -> FloatArray:
        return np.array([float(row[name]) for row in rows])

    remarks = [str(row["remark"]) for row in rows if row.get("remark")]
    return LevelResult(
        level,
        column("youngs_modulus"),
        column("poisson_ratio"),
        column("seconds"),
        tuple(outcome.failure for outcome in outcomes if outcome.row is None),
        tuple(dict.fromkeys(remarks)),
    )
