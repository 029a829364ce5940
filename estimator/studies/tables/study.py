"""A study: cases in levels of what is varied, in groups, and what the paper gives for them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimator.studies.running.case import Case, Outcome
from estimator.studies.tables.figure import Figure

FloatArray = NDArray[np.float64]

# What a row may hold, beside E, ν and the seconds that each has: SI units.
COLUMNS = (
    "youngs_modulus",
    "poisson_ratio",
    "seconds",
    "iterations",
    "calls",
    "rmse_fiducials",
    "rmse_force",
)


@dataclass(frozen=True)
class Level:
    """Cases that differ in nothing but their draw, or one case alone; what the paper gives for them, if anything."""

    label: str
    cases: tuple[Case, ...]
    paper: Figure | None = None


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
    columns : of the cases that gave a row, (n,) each, by :data:`COLUMNS`; NaN where a row says nothing
    outcomes : of all cases, in their order
    """

    level: Level
    columns: Mapping[str, FloatArray]
    outcomes: tuple[Outcome, ...]

    @property
    def failures(self) -> list[str]:
        """Why cases gave no row."""
        return [outcome.failure for outcome in self.outcomes if outcome.row is None]

    @property
    def remarks(self) -> list[str]:
        """What cases have to say, each once."""
        rows = [outcome.row for outcome in self.outcomes if outcome.row is not None]
        return list(dict.fromkeys(str(row["remark"]) for row in rows if row.get("remark")))

    @property
    def youngs_modulus(self) -> FloatArray:
        """E by case, Pa."""
        return self.columns["youngs_modulus"]

    @property
    def poisson_ratio(self) -> FloatArray:
        """Poisson's ratio by case."""
        return self.columns["poisson_ratio"]


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
    columns = {name: np.array([float(row.get(name, np.nan)) for row in rows]) for name in COLUMNS}
    return LevelResult(level, columns, tuple(outcomes))
