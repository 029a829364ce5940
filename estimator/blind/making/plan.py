"""Which cases a set holds: decks of clean cases, one of every label, some outside the catalogue, and doubles."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from estimator.blind.making.effects.catalogue import (
    FORM_SETS,
    FORMS,
    GROUP_OF,
    UNKNOWN,
    FormSet,
    forms_of,
    outside_of,
)
from estimator.blind.making.scenes.scene import Form
from estimator.blind.making.scenes.sizing import LEVELS
from estimator.blind.making.scenes.wide_setup import WITH_PARTS
from estimator.errors import InputError

NONE = "none"
DOUBLE = "double"
BODIES: tuple[str, ...] = (WITH_PARTS,)
"""Phantoms that a set may be limited to."""

CHOICES: tuple[str, ...] = (NONE, UNKNOWN, DOUBLE, *FORMS)

# A laboratory's cause may have a form that the catalogue has, or any other; the score tells them apart.
DEFAULT_FORM_SET: FormSet = "mixed"

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
    wide : whether its phantom, channels, speeds and noise are drawn as other laboratories have them
    body : which phantom it then has, wherever its effects allow it; empty: any
    """

    name: str
    labels: tuple[str, ...]
    forms: tuple[str, ...]
    levels: tuple[str, ...]
    seed: tuple[int, int]
    wide: bool = False
    body: str = ""


def deck_size() -> int:
    """Return how many cases a deck has: as many as a set should have, or a multiple of it."""
    return _CLEAN + len(FORMS) + _OUTSIDE + _DOUBLES


def plan(
    seed: int,
    count: int,
    only: Sequence[str] = (),
    levels: Sequence[str] = (),
    form_set: FormSet = DEFAULT_FORM_SET,
    body: str = "",
) -> tuple[Planned, ...]:
    """Plan a set of ``count`` cases, numbered at random.

    Parameters
    ----------
    only : labels, "none", "unknown" or "double", to which the cases are limited
    levels : to which the sizes are limited; empty: all
    form_set : whose forms the effects have; that of the catalogue has the usual phantoms, any other has all kinds
    body : of the phantoms, of ``BODIES``; empty: all kinds

    Raises
    ------
    InputError
        ``count`` is not positive, a name in ``only``, ``levels``, ``form_set`` or ``body`` is unknown, or the forms of
        the catalogue have no such body.
    """
    if count < 1:
        raise InputError(f"{count} cases: nothing to make; ask for at least one")
    for name in only:
        if name not in CHOICES:
            raise InputError(f"'{name}' is no label; choose from {', '.join(CHOICES)}")
    for name in levels:
        if name not in LEVELS:
            raise InputError(f"'{name}' is no level; choose from {', '.join(LEVELS)}")
    if form_set not in FORM_SETS:
        raise InputError(f"'{form_set}' is no set of forms; choose from {', '.join(FORM_SETS)}")
    if body and body not in BODIES:
        raise InputError(f"'{body}' is no body; choose from {', '.join(BODIES)}")
    if body and form_set == "catalogue":
        raise InputError(f"the forms of the catalogue are on blocks alone; for {body} take --forms mixed")
    random = np.random.default_rng([seed, 0])
    chosen: list[_Entry] = []
    deck_number = 0
    while len(chosen) < count:
        deck = [
            entry for kind, entry in _deck(seed + deck_number, random, form_set) if not only or kind in only
        ]
        chosen += [deck[i] for i in random.permutation(len(deck))]
        deck_number += 1
    allowed = [level for level in LEVELS if not levels or level in levels]
    weights = np.array([_LEVEL_WEIGHTS[level] for level in allowed])
    cases = []
    for number, (labels, forms) in enumerate(chosen[:count], start=1):
        drawn = tuple(str(random.choice(allowed, p=weights / weights.sum())) for _ in labels)
        name, wide = f"case{number:03d}", form_set != "catalogue"
        cases.append(Planned(name, labels, forms, drawn, (seed, number), wide, body))
    return tuple(cases)


def _deck(turn: int, random: np.random.Generator, form_set: FormSet) -> list[tuple[str, _Entry]]:
    """Return one deck: what kind each case is, its labels and forms; forms take turns from deck to deck."""
    known = forms_of(form_set)
    deck: list[tuple[str, _Entry]] = []
    deck += [(NONE, ((), ()))] * _CLEAN
    # The sets of several hands begin elsewhere with each label: else a deck would have one hand's forms alone.
    turns = [turn + (place if form_set == "mixed" else 0) for place in range(len(FORMS))]
    deck += [
        (label, ((label,), (_in_turn(known[label], own),))) for label, own in zip(FORMS, turns, strict=True)
    ]
    unknown = [form.name for form in outside_of(form_set)]
    first = turn * _OUTSIDE
    deck += [(UNKNOWN, ((UNKNOWN,), (unknown[(first + i) % len(unknown)],))) for i in range(_OUTSIDE)]
    for _ in range(_DOUBLES):
        labels = _pair(random)
        forms = tuple(known[label][int(random.integers(len(known[label])))].name for label in labels)
        deck.append((DOUBLE, (labels, forms)))
    return deck


def _in_turn(forms: Sequence[Form], turn: int) -> str:
    return forms[turn % len(forms)].name


def _pair(random: np.random.Generator) -> tuple[str, str]:
    labels = list(FORMS)
    first = labels[int(random.integers(len(labels)))]
    others = [label for label in labels if GROUP_OF[label] != GROUP_OF[first]]
    return first, others[int(random.integers(len(others)))]
