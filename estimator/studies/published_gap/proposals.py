"""What the laboratory should do: which measurement tells the causes apart that the table cannot."""

import math

import numpy as np

from estimator.studies.published_gap.diagnosis import GapDiagnosis, Ranking
from estimator.studies.published_gap.pattern_fit import PatternResult

# A cause that is less probable than this is no longer looked for; nats that decide between two.
_PROBABLE = 0.1
_DECIDING = 3.0
_MOST_REPEATS = 50


def proposals(diagnosis: GapDiagnosis) -> list[str]:
    """Return sentences: what is decided, what is not, and what would."""
    ranking = diagnosis.ranking
    told = [_verdict(ranking)]
    for name, probability in ranking.by_cause.items():
        cause = next(
            cause for result in ranking.results for cause in result.model.causes if cause.name == name
        )
        if probability >= _PROBABLE and cause.direct_check:
            told.append(f"{name} ({probability:.2f}): {cause.direct_check}.")
    if len(ranking.results) > 1:
        told.append(_repeats(diagnosis, ranking.results[0], ranking.results[1]))
    return told


def _verdict(ranking: Ranking) -> str:
    lead, second = ranking.results[:2]
    odds = float(ranking.probability[0] / max(ranking.probability[1], 1e-300))
    names = f"{lead.model.name} over {second.model.name}"
    if math.log(odds) >= _DECIDING:
        return f"The table decides for {names}, by {odds:.0f} to 1."
    return f"The table cannot tell {names}: {odds:.1f} to 1."


def _repeats(diagnosis: GapDiagnosis, one: PatternResult, other: PatternResult) -> str:
    """Return which condition repeated how often would decide between two models, on the scatter of the first."""
    table = diagnosis.table
    predicted = one.model.predicted(one.draws)
    gaps = [
        np.median(mine, axis=0) - np.median(theirs, axis=0)
        for mine, theirs in zip(one.means, other.means, strict=True)
    ]
    scatter = [
        np.full(len(gaps[0]), np.median(predicted.run_e)),
        np.median(predicted.run_nu[:, None] * predicted.softness, axis=0),
    ]
    by_row = sum(gap**2 / (2 * deviation**2) for gap, deviation in zip(gaps, scatter, strict=True))
    best = int(np.argmax(by_row))
    row = table.estimates[best]
    words = f"{row.material}, {row.anchoring.replace('_', ' ')} anchored, {row.motion.replace('_', ' ')}"
    count = math.ceil(_DECIDING / max(float(np.asarray(by_row)[best]), 1e-12))
    names = f"{one.model.name} and {other.model.name}"
    if count > _MOST_REPEATS:
        return f"No condition of the table, however often repeated, would tell {names}: measure one of them directly."
    return f"To tell {names} by retractions alone: {count} more of {words}, where they differ most."
