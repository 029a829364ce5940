"""The score of one or more sets of answers against their keys."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.blind.scoring.answers import Answer
from estimator.blind.scoring.diagnoses import read_diagnoses
from estimator.blind.scoring.entries.entry import Entry, read_entry
from estimator.blind.scoring.entries.standing import check_set, standing_of
from estimator.blind.scoring.families import metrics_by_family
from estimator.blind.scoring.intervals import Figure
from estimator.blind.scoring.keys import open_keys
from estimator.blind.scoring.labels import GROUPS, group_of
from estimator.blind.scoring.metrics import claims, metrics, metrics_by_level
from estimator.blind.scoring.reliability import Claim, reliability
from estimator.blind.scoring.scored import Cases, Metric, Scored
from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.errors import InputError

IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Confusion:
    """How often each truth (row) got each leading answer (column); cases with several causes are left out."""

    names: tuple[str, ...]
    counts: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Score:
    """The whole score.

    Attributes
    ----------
    metrics : over all cases
    by_level : of single causes
    by_family : by how far the catalogue knows the forms
    by_claim : of all but several causes, how often an answer is right by what it claims
    groups, labels : confusion
    unanswered : names of cases with a key and no answer; they count for nothing
    openings : how often the keys have been opened, this time included; of several sets, those opened most often
    cases : how many there are of each kind
    standings : of each file of answers, its name and whether it was given before the keys were opened
    """

    metrics: tuple[Metric, ...]
    by_level: Mapping[str, list[Metric]]
    by_family: Mapping[str, list[Metric]]
    by_claim: tuple[Claim, ...]
    groups: Confusion
    labels: Confusion
    unanswered: tuple[str, ...]
    openings: int
    cases: Mapping[str, int]
    standings: Mapping[str, str]

    def as_json(self) -> dict[str, Any]:
        """Return plain values, ready for :func:`json.dumps`."""
        return {
            "cases": dict(self.cases),
            "unanswered": list(self.unanswered),
            "openings": self.openings,
            "standings": dict(self.standings),
            "metrics": _plain(self.metrics),
            "by_level": {level: _plain(found) for level, found in self.by_level.items()},
            "by_family": {family: _plain(found) for family, found in self.by_family.items()},
            "by_claim": [
                {"from": one.low, "to": one.high, "claimed": one.claimed, **_of_figure(one.right)}
                for one in self.by_claim
            ],
            "confusion": {
                kind: {"names": list(one.names), "counts": one.counts.tolist()}
                for kind, one in (("group", self.groups), ("label", self.labels))
            },
        }


def score_answers(sets: Sequence[tuple[Path, Path]]) -> Score:
    """Score answers against folders of their keys, together, which counts as an opening of each.

    Parameters
    ----------
    sets : of each set of cases, the folder of the diagnosis's answers or a file of anyone's, and the folder of the keys

    Raises
    ------
    InputError
        A folder holds nothing to read, no answer in it has a key, or the keys are not what was committed to.
    """
    scored: list[Scored] = []
    unanswered: list[str] = []
    openings = 0
    standings: dict[str, str] = {}
    for answers, keys in sets:
        given, entry = _read(answers)
        if entry is not None:
            check_set(entry, keys)
        truths, opened = open_keys(keys, f"scored {answers}")
        if entry is not None:
            standings[entry.name] = standing_of(entry, keys, opened)
        found = [Scored(name, key, given[name]) for name, key in truths.items() if name in given]
        if not found:
            raise InputError(
                f"{answers}: no answer has a key in {keys}; cases and keys must bear the same names"
            )
        scored += found
        unanswered += [name for name in truths if name not in given]
        openings = max(openings, opened.count)
    cases = Cases(tuple(scored))
    single = cases.with_one_answer
    return Score(
        metrics=tuple(metrics(cases)),
        by_level=metrics_by_level(cases),
        by_family=metrics_by_family(cases),
        by_claim=tuple(reliability(*claims(single))),
        groups=_confusion(single, group_of),
        labels=_confusion(single, str),
        unanswered=tuple(unanswered),
        openings=openings,
        cases={
            "no gap": len(cases.clean),
            "single cause": len(cases.singles),
            "outside the catalogue": len(cases.outside),
            "several causes": len(cases.doubles),
        },
        standings=standings,
    )


def _read(answers: Path) -> tuple[Mapping[str, Answer], Entry | None]:
    """Return answers by the name of their case, and whose they are where a file of anyone's holds them."""
    if answers.is_dir():
        return read_diagnoses(answers), None
    entry = read_entry(answers)
    return entry.answers, entry


def _confusion(cases: list[Scored], name_of: Callable[[str], str]) -> Confusion:
    pairs = Counter((name_of(case.truths[0]), name_of(case.answer.leading)) for case in cases)
    seen = {name for pair in pairs for name in pair}
    names = [name for name in dict.fromkeys(map(name_of, (*GROUPS, NONE, UNKNOWN))) if name in seen]
    counts = np.array([[pairs[truth, answer] for answer in names] for truth in names], dtype=np.int64)
    return Confusion(tuple(names), counts)


def _plain(found: Iterable[Metric]) -> dict[str, dict[str, Any]]:
    return {metric.name: {**_of_figure(metric.figure), "ceiling": metric.ceiling} for metric in found}


def _of_figure(figure: Figure) -> dict[str, Any]:
    known = figure.count > 0
    return {
        "value": figure.value if known else None,
        "interval95": [figure.low, figure.high] if known else None,
        "cases": figure.count,
    }
