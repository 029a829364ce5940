"""The words of keys and answers, and what a laboratory would act on."""

from collections.abc import Iterable, Mapping

from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.effects.blocks import BLOCK_OF_GROUP, Group
from estimator.effects.catalogue import LABELS

GROUPS: Mapping[str, Group] = {**LABELS, "discretization": "numerics"}

# How far the catalogue knows the form of an effect: it has the formula; it has another of the same mechanism, which
# follows most of it; or neither.
FAMILIES: tuple[str, ...] = ("exact", "near", "far")


def group_of(label: str) -> str:
    """Return the group of a label; "none" and "unknown" are groups of their own."""
    return GROUPS.get(label, label)


def block_of(label: str) -> str:
    """Return the block of the rig on which a label's effect sits."""
    return BLOCK_OF_GROUP[GROUPS[label]]


def within_catalogue(effects: Iterable[str]) -> tuple[str, ...]:
    """Return effects as the diagnosis should name them: what the catalogue does not hold is "unknown"."""
    return tuple(dict.fromkeys(label if label in GROUPS else UNKNOWN for label in effects))


def answers_to(effects: Iterable[str]) -> tuple[str, ...]:
    """Return the right names of the leading cause of a case: its effects, or "none"."""
    return tuple(effects) or (NONE,)
