"""How well causes are named by how far the catalogue knows their form: its own formula, a near one, or neither."""

from collections.abc import Callable, Mapping, Sequence

from estimator.blind.scoring.intervals import (
    CALIBRATION_BINS,
    calibration_error,
    calibration_error_by_chance,
    mean,
    quantile,
    share,
)
from estimator.blind.scoring.labels import FAMILIES
from estimator.blind.scoring.metrics import (
    CONFIDENT,
    all_are_named,
    claims,
    errors_of_material,
    has_right_group,
    is_confidently_wrong,
    log_scores,
    modulus_is_back,
    one_is_named,
    ratio_is_back,
    recognised,
    with_material,
)
from estimator.blind.scoring.scored import PLAIN, Cases, Metric, Scored


def metrics_by_family(cases: Cases) -> Mapping[str, list[Metric]]:
    """Return figures for each family that occurs; cases without an effect belong to none."""
    found = {}
    for family in FAMILIES:
        own = Cases(tuple(case for case in cases.everything if case.key.family == family))
        if own.everything:
            found[family] = _metrics(own)
    return found


def _metrics(cases: Cases) -> list[Metric]:
    singles, plain, named = cases.singles, cases.plain, [case for case in cases.singles if case.is_right]
    # A form without a label is "unknown" at its best: what is claimed of it counts for the calibration too.
    confidence, right = claims([*singles, *cases.outside])
    modulus, ratio = errors_of_material(named)
    with_modulus, with_ratio = with_material(named)
    return [
        _share("single cause: top-1", singles, lambda c: c.is_right),
        _share("single cause: right group", singles, has_right_group),
        _share("single cause: right block", singles, lambda c: c.names_right_block),
        _share(f"of those from {PLAIN:g} σ on: top-1", plain, lambda c: c.is_right),
        _share(f"of those from {PLAIN:g} σ on: right group", plain, has_right_group),
        _share(f"of those from {PLAIN:g} σ on: right block", plain, lambda c: c.names_right_block),
        _share("outside the catalogue: recognised", cases.outside, recognised),
        _share("outside the catalogue: right block", cases.outside_with_block, lambda c: c.names_right_block),
        Metric("log score", mean(log_scores([*singles, *cases.outside])), ""),
        Metric(
            f"calibration error ({CALIBRATION_BINS} bins)",
            calibration_error(confidence, right),
            "",
            calibration_error_by_chance(confidence),
        ),
        _share(f"wrong with more than {CONFIDENT:g}", cases.everything, is_confidently_wrong),
        _share(f"wrong with more than {CONFIDENT:g}, and of the block", cases.everything, _misplaced),
        Metric("rightly named: error of E, median", quantile(modulus, 50), "%"),
        Metric("rightly named: error of ν, median", quantile(ratio, 50), ""),
        _share("rightly named: E within 3 %", with_modulus, modulus_is_back),
        _share("rightly named: ν within 0.01", with_ratio, ratio_is_back),
        _share("several causes: all named", cases.doubles, all_are_named),
        _share("several causes: at least one", cases.doubles, one_is_named),
    ]


def _misplaced(case: Scored) -> bool:
    return is_confidently_wrong(case) and not case.names_right_block


def _share(name: str, cases: Sequence[Scored], holds: Callable[[Scored], bool]) -> Metric:
    return Metric(name, share([holds(case) for case in cases]), "%")
