"""How far the gap closes where nothing was fitted: on a test, a cycle, or the last third of a single loading."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.uniaxial.diagnosis.evidence import Weighed, specimen_with, weigh
from estimator.uniaxial.diagnosis.likelihood import Likelihood
from estimator.uniaxial.diagnosis.rows import Rows
from estimator.uniaxial.diagnosis.specimen import stress_per_modulus

_MOST_FOLDS = 4
Kept = list[np.typing.NDArray[np.bool_]]


@dataclass(frozen=True, slots=True)
class HeldOut:
    """What was left out, and the gap there: root mean square over that of the stress, before, after, noise alone."""

    what: str
    gap_before: float
    gap_after: float
    noise: float

    @property
    def closure(self) -> float:
        """Share of the gap above the noise that is closed."""
        above = self.gap_before - self.noise
        return 0.0 if above <= 0 else (self.gap_before - self.gap_after) / above


def held_out(hypothesis: Weighed, tests: Sequence[Rows]) -> HeldOut:
    """Refit without each part in turn, and predict it."""
    what, folds = _folds(tests)
    sums = np.zeros(4)
    for kept in folds:
        likelihood = Likelihood(tests, kept)
        plain = weigh((), likelihood)
        named = weigh(hypothesis.forms, likelihood, starts=[hypothesis.z])
        if plain is not None and named is not None:
            sums += _errors(plain, named, tests, kept)
    before, after, noise, signal = sums[0], sums[1], sums[2], max(float(sums[3]), 1e-300)
    return HeldOut(
        what, float(np.sqrt(before / signal)), float(np.sqrt(after / signal)), float(np.sqrt(noise / signal))
    )


def _errors(
    plain: Weighed, named: Weighed, tests: Sequence[Rows], kept: Kept
) -> np.typing.NDArray[np.float64]:
    found = np.zeros(4)
    for rows, keep in zip(tests, kept, strict=True):
        out = ~keep
        for place, one in enumerate((plain, named)):
            predicted = one.modulus * stress_per_modulus(specimen_with(one.forms, one.z), rows)
            found[place] += float(np.sum((predicted - rows.stress)[out] ** 2))
        found[2] += float(np.sum(rows.noise[out] ** 2))
        found[3] += float(np.sum(rows.stress[out] ** 2))
    return found


def _folds(tests: Sequence[Rows]) -> tuple[str, list[Kept]]:
    if len(tests) > 1:
        out = range(min(len(tests), _MOST_FOLDS))
        return "each record", [
            [np.full(len(r.strain), k != left) for k, r in enumerate(tests)] for left in out
        ]
    rows = tests[0]
    cycle = (rows.part + 1) // 2  # an unloading and the loading behind it; the first loading is always known
    cycles = int(cycle.max())
    if cycles >= 2:
        left = np.unique(np.linspace(1, cycles, min(cycles, _MOST_FOLDS)).round().astype(int))
        return "each cycle", [[cycle != one] for one in left]
    return "the last third of the rows", [[np.arange(len(rows.strain)) < 2 * len(rows.strain) // 3]]
