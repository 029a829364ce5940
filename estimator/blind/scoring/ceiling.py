"""How often the best possible test would name a cause: what the data of a case allow at the most.

It knows every signature to the letter, that there is at most one cause, and how far that stands out; it only does not
know which. In the linear regime the log odds of a rival with k directions over none are ½ d τ² / (1 + τ²) − ½ k
ln(1 + τ²), d the squared length of the misfit along it and τ² = σ² / k the prior variance of each direction in units of
the noise. It names the rival with the largest, unless noise alone exceeds that in one case of twenty. Two causes are
both named no oftener than either would be, were the other known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.rivals import Rivals

FloatArray = NDArray[np.float64]

_SIGMA = (2.0, 3.0, 4.5, 6.0, 9.0, 15.0, 30.0, 60.0, 120.0)
_DRAWS = 300
_FALSE_ALARMS = 0.05


@dataclass(frozen=True, slots=True)
class Ceiling:
    """How often the best test names a label, by how far an effect of it stands out.

    Attributes
    ----------
    sigma : (n,) rising, standard deviations of the noise
    share : (n,) of draws in which it names the label
    """

    sigma: tuple[float, ...]
    share: tuple[float, ...]

    def at(self, sigma: float) -> float:
        """Return the share at a number of sigma, between those computed along its logarithm."""
        return float(np.interp(np.log(max(sigma, 1e-9)), np.log(self.sigma), self.share))


def ceilings(rivals: Rivals, seed: int = 0) -> dict[str, Ceiling]:
    """Return the ceiling of every label, an effect of which points along any direction of any of its rivals.

    A label whose rivals are all imitated by what is free without them has none. ``seed`` is that of the draws.
    """
    odds = _Odds(rivals, seed)
    bars = [odds.of_noise(sigma) for sigma in _SIGMA]
    rng = np.random.default_rng(seed + 1)
    found = {}
    for label in dict.fromkeys(rivals.labels):
        if np.isin(odds.label, label).any():
            shares = tuple(
                odds.share_named(label, sigma, least, rng) for sigma, least in zip(_SIGMA, bars, strict=True)
            )
            found[label] = Ceiling(_SIGMA, shares)
    return found


def as_json(found: Mapping[str, Ceiling]) -> dict[str, dict[str, list[float]]]:
    """Return plain values, ready for :func:`json.dumps`."""
    return {label: {"sigma": list(one.sigma), "share": list(one.share)} for label, one in found.items()}


class _Odds:
    """The log odds of rivals, for many draws of noise at once."""

    def __init__(self, rivals: Rivals, seed: int) -> None:
        own = [
            (label, part, rivals.directions(part))
            for label, part in zip(rivals.labels, rivals.slices(), strict=True)
        ]
        seen = [one for one in own if one[2].size]
        self.label = np.array([label for label, _, _ in seen])
        self.directions = [(part, directions) for _, part, directions in seen]
        self.inner, self.noise = rivals.inner, rivals.noise(_DRAWS, seed)

    def of_noise(self, sigma: float) -> float:
        """Return the largest log odds that noise alone exceeds in one case of twenty."""
        return float(np.quantile(self._of(self.noise, sigma).max(axis=0), 1.0 - _FALSE_ALARMS))

    def share_named(self, label: str, sigma: float, least: float, rng: np.random.Generator) -> float:
        """Return the share of draws in which effects of a label, of so many sigma, are named and exceed the least."""
        inner = self.noise.copy()
        chosen = rng.choice(np.flatnonzero(self.label == label), size=_DRAWS)
        for draw, number in enumerate(chosen):
            part, directions = self.directions[number]
            way = rng.standard_normal(directions.shape[1])
            amplitudes = directions @ (sigma * way / np.linalg.norm(way))
            inner[:, draw] += self.inner[:, part] @ amplitudes
        odds = self._of(inner, sigma)
        named = self.label[odds.argmax(axis=0)] == label
        return float(np.mean(named & (odds.max(axis=0) > least)))

    def _of(self, inner: FloatArray, sigma: float) -> FloatArray:
        """Return the log odds (rivals, draws) of inner products (k, draws)."""
        found = []
        for part, directions in self.directions:
            count = directions.shape[1]
            variance = sigma**2 / count
            along = np.sum((directions.T @ inner[part]) ** 2, axis=0)
            found.append(0.5 * along * variance / (1.0 + variance) - 0.5 * count * np.log1p(variance))
        return np.array(found)


def ceiling_of(found: Mapping[str, Ceiling], labels: Sequence[str], sigma: float) -> float | None:
    """Return the ceiling of a case whose cause has one of some labels; None where none of them was looked for."""
    shares = [found[label].at(sigma) for label in labels if label in found]
    return max(shares, default=None)
