"""Whether answers are right as often as they claim to be, by how much they claim."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from estimator.blind.scoring.intervals import Figure, share

# Most answers claim nearly everything, and a few less: bins of equal width would leave most of them empty.
EDGES = (0.0, 0.5, 0.7, 0.9, 0.98, 1.0)


@dataclass(frozen=True, slots=True)
class Claim:
    """Answers that claim about as much.

    Attributes
    ----------
    low, high : the probabilities between which the leading answers have theirs
    claimed : its mean
    right : share of the answers that are right, with Wilson's interval
    """

    low: float
    high: float
    claimed: float
    right: Figure


def reliability(confidence: Sequence[float], right: Sequence[bool]) -> list[Claim]:
    """Return how often answers are right by what they claim, without the bins in which there is none.

    A reliability diagram shows the pairs (Murphy & Winkler, Appl. Stat. 26 (1977) 41).

    Parameters
    ----------
    confidence : (n,) probability of each leading answer
    right : (n,) whether it is true
    """
    found = []
    for low, high in itertools.pairwise(EDGES):
        within = [
            (claimed, hit)
            for claimed, hit in zip(confidence, right, strict=True)
            if low <= claimed < high or claimed == high == EDGES[-1]
        ]
        if within:
            claimed = sum(claimed for claimed, _ in within) / len(within)
            found.append(Claim(low, high, claimed, share([hit for _, hit in within])))
    return found
