"""A case: a model of the pattern learnt from some rows of a published table, and what it predicts for all of them."""

from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from estimator.studies.published_gap.pattern import PatternModel
from estimator.studies.published_gap.sampling import sample_posterior
from estimator.studies.running.arrays import as_text, from_text
from estimator.studies.running.case import Row

FloatArray = NDArray[np.float64]

# Of the posterior, kept for intervals.
_KEPT = 400
# Another number draws other particles.
_SEED = 20110509


@dataclass(frozen=True, eq=False)
class PatternFit:
    """One model, one choice of rows to learn from."""

    model: PatternModel
    learnt_from: tuple[bool, ...]

    @property
    def name(self) -> str:
        """The model, and how many rows it learns from."""
        return f"{self.model.name}, from {sum(self.learnt_from)} of {len(self.learnt_from)} rows"

    @cached_property
    def identity(self) -> str:
        """The model's causes, the table, the rows, and everything that the map was learnt from."""
        stated = (self.model.causes, self.model.table, self.learnt_from, self.model.response.digest, _SEED)
        return f"pattern fit {sha256(repr(stated).encode()).hexdigest()}"

    def run(self) -> Row:
        """Sample the posterior."""
        rows = np.array(self.learnt_from)
        found = sample_posterior(
            lambda draws: self.model.log_likelihood(draws, rows),
            self.model.dimension,
            np.random.default_rng(_SEED),
        )
        kept = found.draws[:: max(1, len(found.draws) // _KEPT)]
        return {"log_evidence": found.log_evidence, "draws": as_text(kept)}

    def found(self, row: Row) -> "PatternResult":
        """Return what :meth:`run` kept as a result."""
        return PatternResult(
            self, float(row["log_evidence"]), from_text(str(row["draws"]), (-1, self.model.dimension))
        )


@dataclass(frozen=True, eq=False)
class PatternResult:
    """The posterior of a fit.

    Attributes
    ----------
    fit : whose it is
    log_evidence : of the rows that it was learnt from, nats
    draws : of the parameters, (n, d)
    """

    fit: PatternFit
    log_evidence: float
    draws: FloatArray

    @property
    def model(self) -> PatternModel:
        """The model that was fitted."""
        return self.fit.model

    @cached_property
    def means(self) -> tuple[FloatArray, FloatArray]:
        """Predicted ln E and ν of every row, (n, rows) each, without scatter."""
        predicted = self.model.predicted(self.draws)
        return predicted.log_modulus, predicted.poisson_ratio

    def sizes(self) -> dict[str, tuple[float, float, float]]:
        """Return of every size the median and the ends of its 90 % interval."""
        return {name: _interval(values) for name, values in self.model.size_values(self.draws).items()}

    def closed(self, rows: NDArray[np.bool_]) -> dict[str, tuple[float, float, float]]:
        """Return which share of the gap of some rows closes in E and in ν: median and 90 % interval.

        The gap is that from the bench test's E, and from a ν of 0.499, to what was published; the share of it that
        closes is 1 less the root mean square of what the model leaves over that of the gap. It is negative where a
        model leaves more.
        """
        table = self.model.table
        bench = np.array([table.bench[one.material].youngs_modulus_pa for one in table.estimates])
        published = {"E": table.log_modulus, "nu": table.poisson_ratio}
        ideal = {"E": np.log(bench), "nu": np.full(len(bench), 0.499)}
        shares = {}
        for name, mean in zip(("E", "nu"), self.means, strict=True):
            left = _root_mean_square((published[name] - mean)[:, rows])
            gap = _root_mean_square((published[name] - ideal[name])[None, rows])
            shares[name] = _interval(1 - left / gap)
        return shares


def _interval(values: FloatArray) -> tuple[float, float, float]:
    """Return the median, and the ends of the 90 % interval."""
    low, middle, high = (float(value) for value in np.quantile(values, (0.05, 0.5, 0.95)))
    return middle, low, high


def _root_mean_square(values: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(values**2, axis=1)))
