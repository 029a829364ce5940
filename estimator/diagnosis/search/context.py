"""What every step of a comparison needs: the case, the hypothesis that others are held against, and who works."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from estimator.diagnosis.evidence.discrepancy import ModelError
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import Catalogue, default_catalogue

# Told what is being done, how much of it is done, and how much there is.
Tell: TypeAlias = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Context:
    """A case with a solved hypothesis, beside which others are weighed.

    Attributes
    ----------
    case : Case
    baseline : the solved hypothesis: the fitted baseline, unless another one is named
    error : what any model misses
    executor : the workers
    tell : who is told of the progress
    catalogue : the effects that are looked for
    """

    case: Case
    baseline: Linearisation
    error: ModelError
    executor: Executor
    tell: Tell
    catalogue: Catalogue = field(default_factory=default_catalogue)

    @property
    def settings(self) -> DiagnosisSettings:
        """Those of the case."""
        return self.case.settings

    @property
    def beads_seen(self) -> int:
        """How many beads were seen at all."""
        seen = [np.isfinite(one.fiducials).any(axis=(0, 2)) for one in self.case.experiments]
        return int(np.logical_or.reduce(seen).sum())

    def beside(self, fit: Linearisation) -> Context:
        """Return the context with another solved hypothesis in the baseline's place."""
        return replace(self, baseline=fit)
