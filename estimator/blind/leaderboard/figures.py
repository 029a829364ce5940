"""The figures of an entry that a leaderboard compares; ``docs/challenge.md`` has their formulas."""

from collections.abc import Callable, Sequence

from estimator.blind.scoring.intervals import calibration_error, mean, quantile, share
from estimator.blind.scoring.metrics import (
    CONFIDENT,
    all_are_named,
    claims,
    errors_of_material,
    has_right_group,
    is_confidently_wrong,
    log_scores,
    modulus_is_covered,
    one_is_named,
    ratio_is_covered,
    recognised,
    with_material,
)
from estimator.blind.scoring.scored import Cases, Metric, Scored

LOG_SCORE = "log score"
TOP_1, BLOCK, FALSE_ALARMS = "top-1", "right block", "false alarms"
CALIBRATION, MODULUS, SECONDS = "calibration error", "E, median error", "time a case, median"


def figures(cases: Cases) -> list[Metric]:
    """Return every figure of an entry, those without a case among them."""
    singles, asked = cases.singles, cases.with_one_answer
    placed = [*singles, *cases.outside_with_block]
    with_truth = [*singles, *cases.clean]
    modulus, ratio = errors_of_material(with_truth)
    told_modulus, told_ratio = with_material(with_truth)
    return [
        Metric(LOG_SCORE, mean(log_scores(asked)), ""),
        _share(TOP_1, singles, lambda c: c.is_right),
        _share("right group", singles, has_right_group),
        _share(BLOCK, placed, lambda c: c.names_right_block),
        _share(FALSE_ALARMS, cases.clean, lambda c: bool(c.answer.verdict)),
        _share("unknown recognised", cases.outside, recognised),
        _share(f"wrong with more than {CONFIDENT:g}", cases.everything, is_confidently_wrong),
        Metric(CALIBRATION, calibration_error(*claims(asked)), ""),
        _share("several causes: all named", cases.doubles, all_are_named),
        _share("several causes: at least one", cases.doubles, one_is_named),
        Metric(MODULUS, quantile(modulus, 50), "%"),
        _share("E in its interval", told_modulus, modulus_is_covered),
        Metric("half-width of E's interval, median", quantile(_half_widths(told_modulus), 50), "%"),
        Metric("ν, median error", quantile(ratio, 50), ""),
        _share("ν in its interval", told_ratio, ratio_is_covered),
        Metric(SECONDS, quantile([case.answer.seconds for case in cases.everything], 50), "s"),
    ]


def family_figures(cases: Cases) -> list[Metric]:
    """Return the figures of the cases of one family, which have a cause each."""
    single = [*cases.singles, *cases.outside]
    return [
        Metric(LOG_SCORE, mean(log_scores(single)), ""),
        _share(TOP_1, cases.singles, lambda c: c.is_right),
        _share("right group", cases.singles, has_right_group),
        _share(BLOCK, [*cases.singles, *cases.outside_with_block], lambda c: c.names_right_block),
        _share(f"wrong with more than {CONFIDENT:g}", cases.everything, is_confidently_wrong),
        Metric(CALIBRATION, calibration_error(*claims(single)), ""),
        Metric(MODULUS, quantile(errors_of_material(cases.singles)[0], 50), "%"),
    ]


def _half_widths(cases: Sequence[Scored]) -> list[float]:
    """Return half the width of the interval of E, as a share of its value."""
    return [
        (told.high - told.low) / (2 * told.value)
        for case in cases
        if (told := case.answer.youngs_modulus) is not None
    ]


def _share(name: str, cases: Sequence[Scored], holds: Callable[[Scored], bool]) -> Metric:
    return Metric(name, share([holds(case) for case in cases]), "%")
