"""A model of a published pattern: which causes act, what they do to (E, ν) of every row, and how the rows scatter.

    ln Ê_i = ln E_m + ln g_c(s E_m^p) + δ_k + ε_i,        ν̂_i = h_c(s E_m^p) + δ'_k + ε'_i

for row i of material m under condition c in mounting k (a material under an anchoring). g and h are the learnt map,
with locking always in it; s are the causes' sizes, common to all rows; ln E_m is normal about the bench test with its
deviation. δ and ε are scatter between specimens and between runs, normal, their deviations unknown. That of ν may grow
as a power of how much softer a material is than the stiffest, since its forces drown the sooner.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.special import ndtr

from estimator.studies.published_gap.candidate import Candidate, Size
from estimator.studies.published_gap.published import PublishedTable
from estimator.studies.published_gap.simulations import TISSUE_RATIOS

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Even in the logarithm between these: of ln E and of ν, between runs and between mountings.
_SCATTER = {
    "run_e": (0.01, 0.4),
    "run_nu": (0.01, 0.25),
    "mounting_e": (0.005, 0.4),
    "mounting_nu": (0.005, 0.25),
}
# Points along a size on which the estimator is run once; between them its estimates are interpolated.
_FINE, _COARSE, _ALONG_THRESHOLD = 41, 17, 9
_LEAST_GAIN = 0.01


class Map(Protocol):
    """From causes and their sizes to what the estimator of a table reports, for the six conditions."""

    @property
    def digest(self) -> str:
        """Everything that it was learnt from, in short."""

    @property
    def locking(self) -> tuple[FloatArray, FloatArray]:
        """E over that of the tissue, and ν, (6,) each, where no cause acts."""

    @property
    def by_tissue_ratio(self) -> tuple[FloatArray, FloatArray]:
        """The same for each ν of :data:`~.learning.TISSUE_RATIOS`, (3, 6) each."""

    def estimates(self, acting: Sequence[tuple[Candidate, FloatArray]]) -> tuple[FloatArray, FloatArray]:
        """Return the same, (n, 6) each, where candidates act with sizes (n, s) at the reference modulus."""


@dataclass(frozen=True, eq=False)
class Predicted:
    """Means of ln E (n, rows) and ν (n, rows), and deviations (n,) of their scatter; softness (n, rows) as above."""

    log_modulus: FloatArray
    poisson_ratio: FloatArray
    run_e: FloatArray
    run_nu: FloatArray
    mounting_e: FloatArray
    mounting_nu: FloatArray
    softness: FloatArray


@dataclass(frozen=True, eq=False)
class PatternModel:
    """A published table under some candidate causes.

    Attributes
    ----------
    table : the published one
    causes : that act, none for locking alone
    response : the learnt map
    """

    table: PublishedTable
    causes: tuple[Candidate, ...]
    response: Map

    @property
    def name(self) -> str:
        """The causes, or locking alone."""
        return " + ".join(cause.name for cause in self.causes) or "locking alone"

    @property
    def sizes(self) -> list[tuple[Candidate, Size]]:
        """All sizes, cause by cause."""
        return [(cause, size) for cause in self.causes for size in cause.sizes]

    @property
    def dimension(self) -> int:
        """How many parameters there are."""
        materials = len(self.table.materials)
        by_material = sum(cause.on_bench == "each" for cause in self.causes)
        return materials + 1 + len(_SCATTER) + 1 + len(self.sizes) + by_material * materials

    def size_values(self, draws: FloatArray) -> dict[str, FloatArray]:
        """Return the sizes, (n,) each in its own unit, of parameters (n, d)."""
        start = len(self.table.materials) + 1 + len(_SCATTER) + 1
        return {
            f"{cause.name} {size.name}": size.of_quantile(ndtr(draws[:, start + number]))
            for number, (cause, size) in enumerate(self.sizes)
        }

    def true_modulus(self, draws: FloatArray) -> FloatArray:
        """Return E of the tissue of each material, (n, m), Pa."""
        materials = len(self.table.materials)
        bench = np.array([self.table.bench[m].youngs_modulus_pa for m in self.table.materials])
        deviation = np.array([self.table.bench[m].std_pa for m in self.table.materials])
        spread = np.sqrt(np.log1p((deviation / bench) ** 2))
        log = np.log(bench) - spread**2 / 2 + spread * draws[:, :materials]
        sizes = self.size_values(draws)
        extra = draws.shape[1] - materials * sum(cause.on_bench == "each" for cause in self.causes)
        for cause in self.causes:
            if cause.on_bench == "none":
                continue
            size = sizes[f"{cause.name} {cause.sizes[0].name}"][:, None]
            if cause.on_bench == "common":
                log = log + size
            elif cause.on_bench == "relaxed":
                log = log - np.log1p(size)
            else:
                log = log + size * draws[:, extra : extra + materials]
                extra += materials
        return np.asarray(np.exp(log))

    def predicted(self, draws: FloatArray) -> Predicted:
        """Return what parameters (n, d), standard normal a priori, predict for every row."""
        materials = len(self.table.materials)
        modulus = self.true_modulus(draws)
        log_gain, ratio = self._mapped(draws, modulus)
        share = ndtr(draws[:, materials])
        shift_e, shift_nu = self._by_tissue_ratio(share)
        row, condition = self.table.material_of, self.table.condition_of
        scatter = {}
        for number, (name, (low, high)) in enumerate(_SCATTER.items()):
            scatter[name] = low * (high / low) ** ndtr(draws[:, materials + 1 + number])
        power = ndtr(draws[:, materials + 1 + len(_SCATTER)])
        softer = np.log(modulus.max(axis=1, keepdims=True) / modulus)
        return Predicted(
            np.log(modulus)[:, row] + log_gain[:, row, condition] + shift_e[:, condition],
            np.clip(ratio[:, row, condition] + shift_nu[:, condition], 0.0, 0.4999),
            softness=np.exp(power[:, None] * softer)[:, row],
            **scatter,
        )

    def log_likelihood(self, draws: FloatArray, rows: BoolArray) -> FloatArray:
        """Return the logarithm of the probability density of some rows, (n,)."""
        seen = self.predicted(draws)
        off_e = self.table.log_modulus - seen.log_modulus
        off_nu = (self.table.poisson_ratio - seen.poisson_ratio) / seen.softness
        anchoring = self.table.condition_of // 3
        mounting = self.table.material_of * 2 + anchoring
        total = -np.sum(np.log(seen.softness[:, rows]), axis=1)
        for number in np.unique(mounting[rows]):
            chosen = rows & (mounting == number)
            total = total + _grouped(off_e[:, chosen], seen.run_e, seen.mounting_e)
            total = total + _grouped(off_nu[:, chosen], seen.run_nu, seen.mounting_nu)
        return np.asarray(total)

    def _mapped(self, draws: FloatArray, modulus: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ln of E over that of the tissue, and ν, (n, m, 6) each."""
        count, materials = modulus.shape
        deforming = [(cause, size) for cause, size in self.sizes if cause.effect]
        if not deforming:
            gain, ratio = self.response.locking
            whole = np.ones((count, materials, 1))
            return whole * np.log(gain), whole * ratio
        values = self.size_values(draws)
        at = np.stack(
            [
                size.at_reference(values[f"{cause.name} {size.name}"][:, None], modulus)
                for cause, size in deforming
            ],
            axis=-1,
        )
        found = self._grid(_scaled(at, [size for _, size in deforming])).reshape(count, materials, 2, -1)
        return found[:, :, 0], found[:, :, 1]

    @cached_property
    def _grid(self) -> RegularGridInterpolator:
        """The map on a grid over the sizes at the reference modulus."""
        deforming = [(cause, size) for cause, size in self.sizes if cause.effect]
        fine = _FINE if len(deforming) == 1 else _COARSE
        axes = [_axis(size, fine) for _, size in deforming]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        acting, column = [], 0
        for cause in self.causes:
            if cause.effect:
                acting.append((cause, points[:, column : column + len(cause.sizes)]))
                column += len(cause.sizes)
        gain, ratio = self.response.estimates(acting)
        # Two causes together may leave no pull at all, which no search reports.
        values = np.concatenate([np.log(np.maximum(gain, _LEAST_GAIN)), ratio], axis=1).reshape(
            *map(len, axes), -1
        )
        scaled = [
            _scaled(axis[:, None], [size])[:, 0] for axis, (_, size) in zip(axes, deforming, strict=True)
        ]
        return RegularGridInterpolator(scaled, values)

    def _by_tissue_ratio(self, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what another ν of the tissue than the usual adds to ln E and ν, (n, 6) each."""
        gain, ratio = self.response.by_tissue_ratio
        ends = -np.log1p(-2 * np.array(TISSUE_RATIOS))
        at = ends[0] + share * (ends[-1] - ends[0])
        change_e, change_nu = np.log(gain) - np.log(gain[1]), ratio - ratio[1]
        columns = range(gain.shape[1])
        return (
            np.stack([np.interp(at, ends, change_e[:, c]) for c in columns], axis=1),
            np.stack([np.interp(at, ends, change_nu[:, c]) for c in columns], axis=1),
        )


def _axis(size: Size, points: int) -> FloatArray:
    if size.between is not None:
        return np.geomspace(size.nodes[0], size.nodes[-1], _ALONG_THRESHOLD)
    ends = np.array([min(0.0, size.nodes[0]), size.nodes[-1]])
    return np.unique([*np.linspace(ends[0], ends[1], points), *size.nodes])


def _scaled(sizes: FloatArray, of: Sequence[Size]) -> FloatArray:
    """Return thresholds by their logarithm."""
    logs = np.array([size.between is not None for size in of])
    return np.where(logs, np.log(np.where(logs, sizes, 1.0)), sizes)


def _grouped(off: FloatArray, run: FloatArray, common: FloatArray) -> FloatArray:
    """Return the log density of residuals (n, k) that share an error of deviation ``common`` beside their own."""
    count = off.shape[1]
    own, together = run**2, run**2 + count * common**2
    mean = off.mean(axis=1)
    within = np.sum((off - mean[:, None]) ** 2, axis=1)
    square = within / own + count * mean**2 / together
    return np.asarray(
        -0.5 * (square + (count - 1) * np.log(own) + np.log(together) + count * np.log(2 * np.pi))
    )
