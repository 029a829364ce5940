"""What else a cause of one label could do: a discrepancy that has the shape of the label's own forms.

A label is a family of forms, and the true one is rarely the one that was fitted. What a form leaves of its own cause
looks like other forms of it, at other places, times and thresholds, and not like anything smooth. So beside a refitted
cause all signatures of its label may act too, each by an amplitude of its own, normal about nothing; together they make
up a share of what the cause explains (the inexactness of a signature; M. Kennedy and A. O'Hagan, J. R. Stat. Soc. B 63
(2001) 425, with a discrepancy that knows its cause). What they explain is no evidence of a second cause.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import Moments
from estimator.diagnosis.evidence.floors import over_floors
from estimator.diagnosis.evidence.marginal_likelihood import priors_of
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.screening import moments_beside
from estimator.inference.laplace import Priors, log_mean

FloatArray = NDArray[np.float64]

# Of the variance along the signatures what is less than this share of the largest is none.
_UNSEEN = 1e-6


def explained_by_other_forms(context: Context, signatures: Sequence[Signature], one: Candidate) -> float:
    """Return by how much the log evidence of a candidate rises where other forms of its labels may act too.

    Parameters
    ----------
    context : with the fitted baseline
    signatures : of the catalogue, beside the baseline; those of other labels are left aside
    one : refitted
    """
    own = [each for each in signatures if each.effect.label in one.labels and each.free_parameters]
    if not own:
        return 0.0
    size = float(np.sqrt(max(context.baseline.chi2 - one.fit.chi2, 0.0)))
    known = 1 + len(one.fit.free_parameters)
    moments = _principal(moments_beside(context.beside(one.fit), own), known)
    priors = priors_of(one.fit.free_parameters, context.settings.evidence)
    more = len(moments.gram) - known
    alone = over_floors(moments.among(range(known)), priors, context.error)
    found = [
        over_floors(moments, _with_more(priors, more, share * size), context.error) if share * size else alone
        for share in context.settings.evidence.inexact
    ]
    return max(0.0, log_mean(found) - alone)


def _principal(moments: Moments, known: int) -> Moments:
    """Return moments with the columns from ``known`` on replaced by their principal ones, of unit variance in all.

    Each column counts alike, with what is free in the fit projected out; one that no reading feels does not count.
    """
    felt = [*range(known), *(known + np.flatnonzero(np.diag(moments.gram)[known:]))]
    moments = moments.among(felt)
    gram, count = moments.gram, len(moments.gram) - known
    free, family = slice(1, known), slice(known, None)
    passed = np.linalg.lstsq(gram[free, free], gram[free, family], rcond=None)[0]
    left = gram[family, family] - gram[family, free] @ passed
    length = np.sqrt(np.maximum(np.diag(left), _UNSEEN * np.diag(gram)[family]))
    values, vectors = np.linalg.eigh(left / np.outer(length, length) / max(count, 1))
    kept = values > _UNSEEN * np.max(values, initial=0.0)
    combined = vectors[:, kept] / length[:, None] / np.sqrt(max(count, 1))
    change = np.zeros((len(gram), known + combined.shape[1]))
    change[:known, :known] = np.eye(known)
    change[free, known:] = -passed @ combined
    change[family, known:] = combined
    along = tuple((wrench @ change, fiducials @ change) for wrench, fiducials in moments.along)
    return Moments(change.T @ gram @ change, along)


def _with_more(priors: Priors, count: int, deviation: float) -> Priors:
    """Return priors with so many more parameters, normal about nothing."""
    open_ends = np.full(count, np.inf)
    return replace(
        priors,
        common=np.concatenate([priors.common, np.zeros(count, dtype=bool)]),
        centre=np.concatenate([priors.centre, np.zeros(count)]),
        scale=np.concatenate([priors.scale, np.full(count, deviation)]),
        lower=np.concatenate([priors.lower, -open_ends]),
        upper=np.concatenate([priors.upper, open_ends]),
        amplitude_of=np.concatenate([priors.amplitude_of, np.full(count, -1)]),
    )
