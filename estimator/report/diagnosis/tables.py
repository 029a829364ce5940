"""The numbers behind a diagnosis: the state of every effect, and the gaps."""

import math

from estimator.diagnosis.result import Diagnosis, EffectFinding, State
from estimator.report import page
from estimator.report.diagnosis.findings import gap_rows
from estimator.report.diagnosis.quantities import (
    STATE_WORDS,
    closure_text,
    detectable_text,
    parameters_text,
    percent,
    sigma,
    words_of,
)
from estimator.report.page import Html

_ORDER: tuple[State, ...] = ("present", "negligible", "not_solved", "cannot_tell", "absent")


def effect_table(diagnosis: Diagnosis) -> Html:
    """Return the state of every effect, those that are present first, then by probability."""
    head = ("effect", "group", "state", "probability", "χ² drop", "closes", "best size", "would show from")
    findings = sorted(
        diagnosis.effects.values(), key=lambda f: (_ORDER.index(f.state), -f.probability, f.label)
    )
    return page.table("Every effect of the catalogue", head, [_effect_cells(finding) for finding in findings])


def _effect_cells(finding: EffectFinding) -> tuple[str, ...]:
    return (
        words_of(finding.label),
        finding.group,
        STATE_WORDS[finding.state],
        percent(finding.probability),
        f"{finding.chi2_drop:.0f}" if math.isfinite(finding.chi2_drop) else "–",
        closure_text(finding.closure_held_out),
        parameters_text(finding) or "–",
        detectable_text(finding),
    )


def gap_table(diagnosis: Diagnosis) -> Html:
    """Return the gap of all data, of each channel and of each experiment."""
    rows = [
        (
            name,
            sigma(gap.before),
            sigma(gap.after),
            sigma(gap.floor),
            closure_text(gap.closure_held_out, gap.closure_std),
        )
        for name, gap in gap_rows(diagnosis)
    ]
    return page.table(
        "Gap on experiments left out of the fit", ("", "before", "after", "floor", "closure"), rows
    )
