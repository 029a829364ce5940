"""What several causes do at once, from what each does alone.

A cause with a stiffness of its own, such as a gripper that gives way, takes its share from the force that the others
leave: in tissue that another cause makes twice as stiff, a compliance does what twice of it does in the tissue alone.
So causes act in turn. Those without a stiffness of their own come first, and each further one acts with its sizes at
the stiffness that those before it leave. Two compliances C₁ and C₂ in series with a stiffness K then leave
1 / (1 + C₁ K) · 1 / (1 + C₂ K / (1 + C₁ K)) = 1 / (1 + C₁ K + C₂ K) of the force, in either order.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.studies.published_gap.paper_estimator import Readings

FloatArray = NDArray[np.float64]

COMPOSED = "in turn"
"""How causes act together, by which stored fits of pairs are told from those of another way."""


@dataclass(frozen=True)
class Part:
    """One of the causes that act together.

    Attributes
    ----------
    change : what it changes of the readings in tissue that is (n,) times as stiff
    has_stiffness : whether that depends on how stiff the tissue is
    """

    change: Callable[[FloatArray], Readings]
    has_stiffness: bool


def in_turn(base: Readings, parts: Sequence[Part]) -> Readings:
    """Return what parts leave of readings (n, ...), each acting on what those before it leave."""
    stiffer = np.ones(len(base.force))
    changes = []
    for part in sorted(parts, key=lambda part: part.has_stiffness):
        changes.append(part.change(stiffer))
        stiffer = stiffer * (1 + _share(changes[-1].force, base.force).reshape(-1))
    return together(base, changes)


def together(base: Readings, changes: Sequence[Readings]) -> Readings:
    """Return what several changes do at once.

    The part k of a change that is proportional to what is seen without any acts on all of the rest as well:
    (1 + k₁)(1 + k₂) r + (1 + k₂) d₁ + (1 + k₁) d₂, where kᵢ r + dᵢ are the changes of r. Two causes that each take a
    share of the force leave the product of what they leave, not the difference of what they take.
    """
    moved = _together(base.moved, [change.moved for change in changes])
    return Readings(moved, _together(base.force, [change.force for change in changes]))


def _together(base: FloatArray, changes: Sequence[FloatArray]) -> FloatArray:
    total, scale = base, np.ones((len(base), *[1] * (base.ndim - 1)))
    for change in changes:
        along = _share(change, base)
        total = (1 + along) * total + scale * (change - along * base)
        scale = scale * (1 + along)
    return total


def _share(change: FloatArray, base: FloatArray) -> FloatArray:
    """Return the part of a change that is proportional to the base, over the base: (n, 1, ...)."""
    axes = tuple(range(1, base.ndim))
    along = np.sum(change * base, axis=axes, keepdims=True) / np.sum(base**2, axis=axes, keepdims=True)
    return np.asarray(along)
