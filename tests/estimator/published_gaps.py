"""Published tables with a known cause, and a map that is known in closed form."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.studies.published_gap.candidate import Candidate, Size
from estimator.studies.published_gap.pattern import PatternModel
from estimator.studies.published_gap.published import Bench, PublishedEstimate, PublishedTable
from estimator.studies.published_gap.simulations import CONDITIONS

FloatArray = NDArray[np.float64]

SOFTER = Candidate(
    "E falls with E",
    "x:a",
    (Size("compliance", "1", (0.5, 4.0), 0.3, grows_with=1),),
    called="softer",
)
NARROWER = Candidate(
    "ν falls",
    "x:b",
    (Size("share", "1", (0.5, 4.0), 1.0),),
    called="narrower",
)
BENCH_OFF = Candidate(
    "the bench is off",
    sizes=(Size("log_factor", "1", (-1.0, 1.0), 0.3, one_sided=False),),
    on_bench="common",
    called="bench_off",
)
BENCHES = {"hard": Bench(36e3, 1e3), "middle": Bench(11e3, 0.5e3), "soft": Bench(5e3, 0.3e3)}


@dataclass(frozen=True)
class KnownMap:
    """E falls by a share that grows with the first cause's size, ν by one that grows with the second's."""

    digest: str = "known"
    missing: tuple[str, ...] = ()

    @property
    def locking(self) -> tuple[FloatArray, FloatArray]:
        return np.linspace(0.9, 0.95, 6), np.linspace(0.35, 0.45, 6)

    @property
    def by_tissue_ratio(self) -> tuple[FloatArray, FloatArray]:
        gain, ratio = self.locking
        return np.tile(gain, (3, 1)), np.tile(ratio, (3, 1))

    def estimates(self, acting: Sequence[tuple[Candidate, FloatArray]]) -> tuple[FloatArray, FloatArray]:
        count = len(acting[0][1]) if acting else 1
        gain, ratio = (np.tile(value, (count, 1)) for value in self.locking)
        for cause, sizes in acting:
            if cause is SOFTER:
                gain = gain / (1 + 0.1 * sizes)
            else:
                ratio = ratio - 0.05 * sizes * np.linspace(1.0, 0.5, 6)
        return gain, ratio


def planted(
    causes: tuple[Candidate, ...], draws: FloatArray, scatter: float = 0.01, seed: int = 3
) -> PublishedTable:
    """Return the table that a model with parameters (d,) predicts, with that scatter."""
    rows = tuple(
        PublishedEstimate(material, anchoring, motion, 1e4, 0.4)
        for material in BENCHES
        for anchoring, motion in CONDITIONS
    )
    empty = PublishedTable("planted", BENCHES, rows)
    model = PatternModel(empty, causes, KnownMap())
    predicted = model.predicted(draws[None, : model.dimension])
    random = np.random.default_rng(seed)
    modulus = np.exp(predicted.log_modulus[0] + scatter * random.normal(size=len(rows)))
    ratio = predicted.poisson_ratio[0] + scatter * random.normal(size=len(rows))
    return PublishedTable(
        "planted",
        BENCHES,
        tuple(
            PublishedEstimate(one.material, one.anchoring, one.motion, float(e), float(nu))
            for one, e, nu in zip(rows, modulus, ratio, strict=True)
        ),
    )
