"""Scores entries on the same keys, opened once, and ranks them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from estimator.blind.leaderboard.figures import LOG_SCORE, family_figures, figures
from estimator.blind.scoring.entries.entry import Entry
from estimator.blind.scoring.entries.standing import check_set, standing_of
from estimator.blind.scoring.keys import open_keys
from estimator.blind.scoring.labels import FAMILIES
from estimator.blind.scoring.scored import Cases, Metric, Scored
from estimator.blind.sealing.openings import Openings
from estimator.blind.sealing.register import Standing
from estimator.errors import InputError


@dataclass(frozen=True, slots=True)
class Ranked:
    """An entry with its figures, over all cases and by how far the catalogue knows the form."""

    entry: Entry
    standing: Standing
    figures: tuple[Metric, ...]
    by_family: Mapping[str, Sequence[Metric]]

    def value(self, name: str) -> float:
        """Return a figure by its name; NaN where no case has one."""
        return next(one.figure.value for one in self.figures if one.name == name)


@dataclass(frozen=True, slots=True)
class Leaderboard:
    """Entries to one set, the best log score first.

    Attributes
    ----------
    set_hash : of the set
    openings : of its keys, this one among them
    cases : how many there are of each kind
    ranked : the entries
    """

    set_hash: str
    openings: Openings
    cases: Mapping[str, int]
    ranked: tuple[Ranked, ...]

    def as_json(self) -> dict[str, Any]:
        """Return plain values, ready for :func:`json.dumps`."""
        first = self.openings.first
        return {
            "set": self.set_hash,
            "openings": self.openings.count,
            "first_opened": first.isoformat() if first else None,
            "cases": dict(self.cases),
            "entries": [
                {
                    "name": one.entry.name,
                    "answered": one.entry.answered.isoformat(),
                    "sha256": one.entry.answers_hash,
                    "standing": one.standing,
                    "figures": _plain(one.figures),
                    "by_family": {family: _plain(found) for family, found in one.by_family.items()},
                }
                for one in self.ranked
            ],
        }


def ranked(entries: Sequence[Entry], keys: Path) -> Leaderboard:
    """Score entries against the keys of their set, which counts as one opening.

    Raises
    ------
    InputError
        An entry is of another set or leaves a case out, two have one name, or the keys are not what was committed to.
    """
    names = [entry.name for entry in entries]
    if doubled := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"{doubled[0]}: two entries have this name; tell them apart by it")
    for entry in entries:
        check_set(entry, keys)
    truths, openings = open_keys(keys, f"leaderboard of {', '.join(names)}")
    found = []
    for entry in entries:
        cases = Cases(tuple(Scored(name, key, entry.answers[name]) for name, key in truths.items()))
        by_family = {
            family: family_figures(own)
            for family in FAMILIES
            if (own := _of_family(cases, family)).everything
        }
        found.append(Ranked(entry, standing_of(entry, keys, openings), tuple(figures(cases)), by_family))
    found.sort(key=_rank)
    kinds = {
        "no gap": len(cases.clean),
        "single cause": len(cases.singles),
        "outside the catalogue": len(cases.outside),
        "several causes": len(cases.doubles),
    }
    return Leaderboard(entries[0].set_hash, openings, kinds, tuple(found))


def _rank(one: Ranked) -> float:
    score = one.value(LOG_SCORE)
    return math.inf if math.isnan(score) else -score


def _of_family(cases: Cases, family: str) -> Cases:
    return Cases(tuple(case for case in cases.everything if case.key.family == family))


def _plain(found: Sequence[Metric]) -> dict[str, dict[str, Any]]:
    return {
        one.name: {
            "value": one.figure.value if one.figure.count else None,
            "interval95": [one.figure.low, one.figure.high] if one.figure.count else None,
            "cases": one.figure.count,
        }
        for one in found
    }
