"""Which cases a set holds: decks of clean cases, one of every label, some outside the catalogue, and doubles."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from estimator.blind.making.effects import outside
from estimator.blind.making.effects.catalogue import FORMS, GROUP_OF, UNKNOWN
from estimator.blind.making.scenes.sizing import LEVELS
from estimator.errors import InputError

NONE = "none"
DOUBLE = "double"
CHOICES: tuple[str, ...] = (NONE, UNKNOWN, DOUBLE, *FORMS)

_CLEAN = 8
_OUTSIDE = 8
_DOUBLES = 6
# Labels, and names of their forms.
_Entry: TypeAlias = tuple[tuple[str, ...], tuple[str, ...]]

_LEVEL_WEIGHTS = {"large": 0.3, "clear": 0.35, "moderate": 0.25, "subtle": 0.1}


@dataclass(frozen=True, slots=True)
class Planned:
    """One case to be made.

    Attributes
    ----------
    name : of its folder
    labels : of its effects, the answer to it
    forms : names of one for each label
    levels : one for each label, of ``LEVELS``
    seed : of everything that is drawn for it
    """

    name: str
    labels: tuple[str, ...]
    forms: tuple[str, ...]
    levels: tuple[str, ...]
    seed: tuple[int, int]


def deck_size() -> int:
    """Return how many cases a deck has: as many as a set should have, or a multiple of it."""
    return _CLEAN + len(FORMS) + _OUTSIDE + _DOUBLES


def plan(seed: int, count: int, only: Sequence[str] = (), levels: Sequence[str] = ()) -> tuple[Planned, ...]:
    """Plan a set of ``count`` cases, numbered at random.

    Parameters
    ----------
    only : labels, "none", "unknown" or "double", to which the cases are limited
    levels : to which the sizes are limited; empty: all

    Raises
    ------
    InputError
        ``count`` is not positive, or a name in ``only`` or ``levels`` is unknown.
    """
    if count < 1:
        raise InputError(f"{count} cases: nothing to make; ask for at least one")
    for name in only:
        if name not in CHOICES:
            raise InputError(f"'{name}' is no label; choose from {', '.join(CHOICES)}")
    for name in levels:
        if name not in LEVELS:
            raise InputError(f"'{name}' is no level; choose from {', '.join(LEVELS)}")
    random = np.random.default_rng([seed, 0])
    chosen: list[_Entry] = []
    deck_number = 0
    while len(chosen) < count:
        deck = [entry for kind, entry in _deck(seed + deck_number, random) if not only or kind in only]
        chosen += [deck[i] for i in random.permutation(len(deck))]
        deck_number += 1
    allowed = [level for level in LEVELS if not levels or level in levels]
    weights = np.array([_LEVEL_WEIGHTS[level] for level in allowed])
    cases = []
    for number, (labels, forms) in enumerate(chosen[:count], start=1):
        drawn = tuple(str(random.choice(allowed, p=weights / weights.sum())) for _ in labels)
        cases.append(Planned(f"case{number:03d}", labels, forms, drawn, (seed, number)))
    return tuple(cases)


def _deck(turn: int, random: np.random.Generator) -> list[tuple[str, _Entry]]:
    """Return one deck: what kind each case is, its labels and forms; forms take turns from deck to deck."""
    deck: list[tuple[str, _Entry]] = []
    deck += [(NONE, ((), ()))] * _CLEAN
    deck += [(label, ((label,), (_in_turn(label, turn),))) for label in FORMS]
    unknown = list(outside.FORMS)
    first = turn * _OUTSIDE
    deck += [(UNKNOWN, ((UNKNOWN,), (unknown[(first + i) % len(unknown)],))) for i in range(_OUTSIDE)]
    for _ in range(_DOUBLES):
        labels = _pair(random)
        forms = tuple(FORMS[label][int(random.integers(len(FORMS[label])))].name for label in labels)
        deck.append((DOUBLE, (labels, forms)))
    return deck


def _in_turn(label: str, turn: int) -> str:
    return FORMS[label][turn % len(FORMS[label])].name


def _pair(random: np.random.Generator) -> tuple[str, str]:
    labels = list(FORMS)
    first = labels[int(random.integers(len(labels)))]
    others = [label for label in labels if GROUP_OF[label] != GROUP_OF[first]]
    return first, others[int(random.integers(len(others)))]
