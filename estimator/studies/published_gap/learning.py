"""Learns how each candidate and its size change what a retraction shows, from simulations at a few sizes.

Between the simulated sizes the readings are interpolated, not the estimates: they follow an effect smoothly, while ν
of the paper's estimator follows the readings steeply. Of several effects together the changes of the readings are
composed. The estimator then runs on interpolated readings as on any others, with its locking.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from estimator.errors import StudyError
from estimator.studies.published_gap.candidate import Candidate
from estimator.studies.published_gap.composition import COMPOSED, Part, in_turn
from estimator.studies.published_gap.paper_estimator import (
    DEFAULT_REGION,
    LOW_DENSITY_CELLS,
    LowDensityResponse,
    Readings,
    Region,
    ResponseTable,
    estimates,
)
from estimator.studies.published_gap.retractions import ANCHORINGS, SetUp
from estimator.studies.published_gap.simulated import REFERENCE_PA, USUAL_RATIO, SimulatedMounting, stacked
from estimator.studies.published_gap.simulations import CONDITIONS, TISSUE_RATIOS, grid_of, pair_cases
from estimator.studies.running.case import Case, Outcome

FloatArray = NDArray[np.float64]

# Thresholds between the simulated ones, by monotone cubics; between these, linear.
_ALONG_THRESHOLD = 33


@dataclass(frozen=True)
class Check:
    """What the map says at sizes that were simulated and not learnt from: (6,) each, E as a ratio to the tissue's."""

    name: str
    at: tuple[float, ...]
    modulus_simulated: FloatArray
    modulus_mapped: FloatArray
    ratio_simulated: FloatArray
    ratio_mapped: FloatArray

    @property
    def modulus_off(self) -> float:
        """Largest relative error of E."""
        return float(np.max(np.abs(self.modulus_mapped / self.modulus_simulated - 1)))

    @property
    def ratio_off(self) -> float:
        """Largest error of ν."""
        return float(np.max(np.abs(self.ratio_mapped - self.ratio_simulated)))


class ResponseMap:
    """From candidates and sizes at the reference modulus to what the paper's estimator reports.

    Parameters
    ----------
    set_up, candidates : whose simulations were carried out
    outcomes : of :func:`learning_cases`, in its order
    region : of the estimator's scale factor
    cells : of the estimator's mesh

    Raises
    ------
    StudyError
        A simulation without which nothing can be learnt has failed.
    """

    def __init__(
        self,
        set_up: SetUp,
        candidates: Sequence[Candidate],
        outcomes: Mapping[str, Outcome],
        region: Region | None = DEFAULT_REGION,
        cells: tuple[int, int, int] = LOW_DENSITY_CELLS,
    ) -> None:
        self.set_up = set_up
        self.region = region
        learnt = {name: outcome.row for name, outcome in outcomes.items()}
        self._digest = sha256(repr((sorted(learnt.items()), region, COMPOSED)).encode()).hexdigest()
        self._outcomes = outcomes
        self.tables: list[ResponseTable] = []
        for anchoring, motion in CONDITIONS:
            case = LowDensityResponse(set_up, anchoring, motion, cells)
            self.tables.append(case.table(_row(case, outcomes)))
        by_ratio = [
            [SimulatedMounting(set_up, anchoring, poisson_ratio=ratio) for anchoring in ANCHORINGS]
            for ratio in TISSUE_RATIOS
        ]
        self._by_ratio = [self._seen(cases) for cases in by_ratio]
        self._free = self._by_ratio[TISSUE_RATIOS.index(USUAL_RATIO)]
        self.missing: list[str] = []
        self._changes = {
            candidate.name: self._learn(candidate) for candidate in candidates if candidate.effect
        }

    @property
    def digest(self) -> str:
        """Everything that it was learnt from, and how causes act together, in short."""
        return self._digest

    @property
    def locking(self) -> tuple[FloatArray, FloatArray]:
        """E over that of the tissue, and ν, that the estimator finds without any other effect, (6,) each."""
        modulus, ratio = self.estimates([])
        return modulus[0], ratio[0]

    @property
    def by_tissue_ratio(self) -> tuple[FloatArray, FloatArray]:
        """The same for each ν of :data:`TISSUE_RATIOS`, (3, 6) each."""
        found = [estimates(self.tables, seen, self.region) for seen in self._by_ratio]
        return np.concatenate([e for e, _ in found]) / REFERENCE_PA, np.concatenate([r for _, r in found])

    def estimates(self, acting: Sequence[tuple[Candidate, FloatArray]]) -> tuple[FloatArray, FloatArray]:
        """Return E over that of the tissue, and ν, (n, 6) each, where candidates act.

        Parameters
        ----------
        acting : candidates with their sizes (n, s) at the reference modulus
        """
        return self._estimates(self._free, acting)

    def _estimates(
        self, free: Sequence[Readings], acting: Sequence[tuple[Candidate, FloatArray]]
    ) -> tuple[FloatArray, FloatArray]:
        """Return the same from what an undisturbed tissue shows."""
        changes = [(self._changes[one.name], sizes) for one, sizes in acting if one.effect]
        count = len(acting[0][1]) if acting else 1
        seen = []
        for condition, alone in enumerate(free):
            base = alone.times(np.ones(count))
            seen.append(in_turn(base, [change.part(condition, sizes) for change, sizes in changes]))
        modulus, ratio = estimates(self.tables, seen, self.region)
        return modulus / REFERENCE_PA, ratio

    def simulated(self, cases: Sequence[SimulatedMounting]) -> tuple[FloatArray, FloatArray]:
        """Return E over that of the tissue, and ν, (6,) each, of one simulation of each anchoring."""
        modulus, ratio = estimates(self.tables, self._seen(cases), self.region)
        return modulus[0] / REFERENCE_PA, ratio[0]

    def pair_check(
        self, pair: Sequence[Candidate], at: Sequence[tuple[float, ...]], outcomes: Sequence[Outcome]
    ) -> Check | None:
        """Return the map beside a simulation of two causes at once; None where that failed.

        ``outcomes`` are those of :func:`pair_cases`.
        """
        cases = pair_cases(self.set_up, pair, at)
        rows = [outcome.row for outcome in outcomes]
        seen = [
            one
            for case, row in zip(cases, rows, strict=True)
            if row is not None
            for one in case.readings(row)
        ]
        if len(seen) < len(CONDITIONS):
            return None
        modulus, ratio = estimates(self.tables, seen, self.region)
        mapped = self.estimates([(one, np.array([sizes])) for one, sizes in zip(pair, at, strict=True)])
        name = " + ".join(one.name for one in pair)
        sizes = tuple(size for one in at for size in one)
        return Check(name, sizes, modulus[0] / REFERENCE_PA, mapped[0][0], ratio[0], mapped[1][0])

    def __getstate__(self) -> dict[str, object]:
        """Leave out what nothing more is learnt from: a map goes to other processes."""
        return {**self.__dict__, "_outcomes": {}}

    def checks(self, candidate: Candidate) -> list[Check]:
        """Return the map beside simulations that it was not learnt from."""
        found = []
        for at in candidate.checks:
            cases = [candidate.case(self.set_up, anchoring, at) for anchoring in ANCHORINGS]
            if any(self._outcomes[case.identity].row is None for case in cases):
                continue
            modulus, ratio = self.simulated(cases)
            free = self._seen([candidate.undisturbed(self.set_up, anchoring) for anchoring in ANCHORINGS])
            mapped_modulus, mapped_ratio = self._estimates(free, [(candidate, np.array([at]))])
            found.append(Check(candidate.name, at, modulus, mapped_modulus[0], ratio, mapped_ratio[0]))
        return found

    def _seen(self, cases: Sequence[SimulatedMounting]) -> list[Readings]:
        return [one for case in cases for one in case.readings(_row(case, self._outcomes))]

    def _learn(self, candidate: Candidate) -> "_Changes":
        shape = tuple(len(size.nodes) for size in candidate.sizes)
        changes: list[list[Readings] | None] = []
        free = self._seen([candidate.undisturbed(self.set_up, anchoring) for anchoring in ANCHORINGS])
        for at in grid_of(candidate):
            cases = [candidate.case(self.set_up, anchoring, at) for anchoring in ANCHORINGS]
            if failed := [case for case in cases if self._outcomes[case.identity].row is None]:
                self.missing.append(f"{failed[0].name}: {self._outcomes[failed[0].identity].failure}")
                changes.append(None)
                continue
            pairs = zip(self._seen(cases), free, strict=True)
            changes.append([seen - free for seen, free in pairs])
        return _Changes.of(candidate, shape, changes)


@dataclass(frozen=True, eq=False)
class _Changes:
    """Changes of the readings over the nodes of a candidate's sizes."""

    axes: tuple[FloatArray, ...]
    moved: tuple[FloatArray, ...]
    force: tuple[FloatArray, ...]
    powers: FloatArray

    @staticmethod
    def of(
        candidate: Candidate, shape: tuple[int, ...], changes: Sequence[list[Readings] | None]
    ) -> "_Changes":
        """Lay the changes on a grid, with none where the first size is zero; nodes that failed are left out."""
        kept = np.array([change is not None for change in changes]).reshape(shape)
        whole = [kept.all(axis=tuple(a for a in range(kept.ndim) if a != axis)) for axis in range(kept.ndim)]
        of_first = kept if kept.ndim == 1 else whole[0]
        use = [np.flatnonzero(of_first), *(np.arange(length) for length in shape[1:])]
        if not all(len(one) for one in use):
            raise StudyError(f"no size of {candidate.name} could be simulated; give it smaller ones")
        chosen = [changes[int(np.ravel_multi_index(at, shape))] for at in itertools.product(*use)]
        stacks = [stacked([one[c] for one in chosen if one is not None]) for c in range(len(CONDITIONS))]
        size_of = tuple(len(one) for one in use)
        axes = [np.array(s.nodes)[one] for s, one in zip(candidate.sizes, use, strict=True)]
        place = int(np.searchsorted(axes[0], 0.0))
        axes[0] = np.insert(axes[0], place, 0.0)

        fine = [*axes[:1], *(np.geomspace(axis[0], axis[-1], _ALONG_THRESHOLD) for axis in axes[1:])]

        def laid(values: FloatArray) -> FloatArray:
            grid = np.insert(values.reshape(*size_of, *values.shape[1:]), place, 0.0, axis=0)
            if len(axes) == 1:
                return grid
            return np.asarray(PchipInterpolator(np.log(axes[1]), grid, axis=1)(np.log(fine[1])))

        moved, force = (
            tuple(map(laid, each)) for each in ([s.moved for s in stacks], [s.force for s in stacks])
        )
        return _Changes(tuple(fine), moved, force, np.array([size.grows_with for size in candidate.sizes]))

    def part(self, condition: int, sizes: FloatArray) -> Part:
        """Return what it changes under a condition at sizes (n, s), in tissue that is so many times as stiff, (n,)."""
        return Part(
            lambda stiffer: self.at(condition, sizes * stiffer[:, None] ** self.powers), any(self.powers)
        )

    def at(self, condition: int, sizes: FloatArray) -> Readings:
        """Return the changes at sizes (n, s); beyond the simulated ones those of the farthest."""
        return Readings(
            self._interpolated(self.moved[condition], sizes), self._interpolated(self.force[condition], sizes)
        )

    def _interpolated(self, values: FloatArray, sizes: FloatArray) -> FloatArray:
        ends = np.array([[axis[0], axis[-1]] for axis in self.axes])
        inside = np.clip(sizes, ends[:, 0], ends[:, 1])
        if len(self.axes) == 1:
            return np.asarray(PchipInterpolator(self.axes[0], values, axis=0)(inside[:, 0]))
        along = PchipInterpolator(self.axes[0], values, axis=0)(inside[:, 0])
        logs = np.log(self.axes[1])
        at = np.log(inside[:, 1])
        number = np.clip(np.searchsorted(logs, at) - 1, 0, len(logs) - 2)
        rows = np.arange(len(at))
        share = (at - logs[number]) / (logs[number + 1] - logs[number])
        low, high = along[rows, number], along[rows, number + 1]
        weight = share.reshape(-1, *[1] * (low.ndim - 1))
        return np.asarray((1 - weight) * low + weight * high)


def _row(case: Case, outcomes: Mapping[str, Outcome]) -> Mapping[str, float | str]:
    outcome = outcomes[case.identity]
    if outcome.row is None:
        raise StudyError(f"{case.name}: {outcome.failure}; nothing can be learnt without it")
    return outcome.row
