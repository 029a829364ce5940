"""What is asked of a diagnosis, each question one figure over the cases that it concerns."""

import math
from collections.abc import Callable, Mapping, Sequence

from estimator.blind.scoring.answers import Estimate
from estimator.blind.scoring.intervals import (
    CALIBRATION_BINS,
    calibration_error,
    calibration_error_by_chance,
    mean,
    quantile,
    share,
)
from estimator.blind.scoring.labels import group_of
from estimator.blind.scoring.scored import PLAIN, Cases, Metric, Scored
from estimator.diagnosis.model.labels import UNKNOWN

CONFIDENT = 0.9
LEAST_PROBABILITY = 1e-3
_MM = 1e3
_NU_BACK, _MODULUS_BACK = 0.01, 0.03


def metrics(cases: Cases) -> list[Metric]:
    """Return every figure, those without a case among them."""
    return [*_names(cases), *_places(cases), *_amounts(cases), *_calibration(cases), *_doubles(cases)]


def metrics_by_level(cases: Cases) -> Mapping[str, list[Metric]]:
    """Return how single causes are named, by how much they stand out."""
    levels = dict.fromkeys(case.key.level for case in cases.singles if case.key.level)
    return {
        level: _naming([case for case in cases.singles if case.key.level == level])
        for level in sorted(levels)
    }


def _naming(singles: Sequence[Scored]) -> list[Metric]:
    return [
        _share("single cause: top-1", singles, lambda c: c.is_right, _mean_ceiling(singles)),
        _share("single cause: top-3", singles, _is_among_three),
        _share("single cause: right group", singles, has_right_group),
        _share("single cause: some gap seen", singles, lambda c: bool(c.answer.verdict)),
    ]


def _is_among_three(case: Scored) -> bool:
    return case.truths[0] in case.answer.ranking[:3]


def has_right_group(case: Scored) -> bool:
    """Tell whether the leading answer is of the group of the truth."""
    return group_of(case.answer.leading) == group_of(case.truths[0])


def _mean_ceiling(cases: Sequence[Scored]) -> float | None:
    """Return the mean of the cases' ceilings; None without cases, and where one of them is not known."""
    ceilings = [case.ceiling for case in cases if case.ceiling is not None]
    return sum(ceilings) / len(ceilings) if len(ceilings) == len(cases) > 0 else None


def _names(cases: Cases) -> list[Metric]:
    return [
        *_naming(cases.singles),
        _share(f"of those from {PLAIN:g} σ on: top-1", cases.plain, lambda c: c.is_right),
        _share(f"of those from {PLAIN:g} σ on: top-3", cases.plain, _is_among_three),
        _share(f"of those from {PLAIN:g} σ on: right group", cases.plain, has_right_group),
        _share("no gap: false alarms", cases.clean, lambda c: bool(c.answer.verdict)),
        _share("outside the catalogue: recognised", cases.outside, recognised),
        _share("outside the catalogue: confidently wrong", cases.outside, is_confidently_wrong),
        _share("all cases: confidently wrong", cases.everything, is_confidently_wrong),
    ]


def recognised(case: Scored) -> bool:
    """Tell whether something unknown was seen."""
    return UNKNOWN in case.answer.verdict


def is_confidently_wrong(case: Scored) -> bool:
    """Tell whether the likeliest answer is wrong, and has more than nine tenths."""
    label, probability = case.answer.likeliest
    return probability > CONFIDENT and label not in case.truths


def _places(cases: Cases) -> list[Metric]:
    local = [case for case in cases.singles if case.key.centre is not None]
    errors = [
        _MM * math.dist(case.key.centre, case.answer.centre)
        for case in local
        if case.key.centre is not None and case.answer.centre is not None
    ]
    return [
        _share("right block of the rig", cases.singles, lambda c: c.names_right_block),
        _share("outside the catalogue: right block", cases.outside_with_block, lambda c: c.names_right_block),
        _share("local cause: a place is given", local, lambda c: c.answer.centre is not None),
        Metric("place error, median", quantile(errors, 50), "mm"),
        Metric("place error, 90th percentile", quantile(errors, 90), "mm"),
    ]


def _amounts(cases: Cases) -> list[Metric]:
    closures = [case.answer.closure for case in cases.singles if case.answer.closure is not None]
    named = [case for case in cases.singles if case.is_right]
    answered = [*cases.singles, *cases.clean]
    modulus_before, ratio_before = _errors_before(named)
    modulus, ratio = errors_of_material(named)
    with_modulus, with_ratio = with_material(named)
    told_modulus, told_ratio = with_material(answered)
    return [
        Metric("single cause: closure on held-out data, median", quantile(closures, 50), "%"),
        Metric("single cause: closure, 10th percentile", quantile(closures, 10), "%"),
        Metric("single cause: negative closure", share([closure < 0 for closure in closures]), "%"),
        Metric("rightly named: error of E before, median", quantile(modulus_before, 50), "%"),
        Metric("rightly named: error of E after, median", quantile(modulus, 50), "%"),
        _share("rightly named: E within 3 % after", with_modulus, modulus_is_back),
        Metric("rightly named: error of ν before, median", quantile(ratio_before, 50), ""),
        Metric("rightly named: error of ν after, median", quantile(ratio, 50), ""),
        _share("rightly named: ν within 0.01 after", with_ratio, ratio_is_back),
        _share("one cause or none: E in its 95 % interval", told_modulus, modulus_is_covered),
        _share("one cause or none: ν in its 95 % interval", told_ratio, ratio_is_covered),
    ]


def with_material(cases: Sequence[Scored]) -> tuple[list[Scored], list[Scored]]:
    """Return the cases whose answer tells E, and those whose answer tells ν."""
    return (
        [case for case in cases if case.answer.youngs_modulus is not None],
        [case for case in cases if case.answer.poisson_ratio is not None],
    )


def errors_of_material(cases: Sequence[Scored]) -> tuple[list[float], list[float]]:
    """Return by how much E (a share) and ν are off with the causes in, in each case whose answer tells them."""
    modulus = [
        abs(case.answer.youngs_modulus.value / case.key.youngs_modulus - 1)
        for case in cases
        if case.answer.youngs_modulus is not None
    ]
    ratio = [
        abs(case.answer.poisson_ratio.value - case.key.poisson_ratio)
        for case in cases
        if case.answer.poisson_ratio is not None
    ]
    return modulus, ratio


def _errors_before(cases: Sequence[Scored]) -> tuple[list[float], list[float]]:
    """Return the same without the causes."""
    found = [(*case.answer.before, case.key) for case in cases if case.answer.before is not None]
    modulus = [abs(e / key.youngs_modulus - 1) for e, _, key in found]
    return modulus, [abs(nu - key.poisson_ratio) for _, nu, key in found]


def modulus_is_back(case: Scored) -> bool:
    """Tell whether E is within 3 % with the causes in."""
    return max(errors_of_material([case])[0], default=math.inf) <= _MODULUS_BACK


def ratio_is_back(case: Scored) -> bool:
    """Tell whether ν is within 0.01 with the causes in."""
    return max(errors_of_material([case])[1], default=math.inf) <= _NU_BACK


def modulus_is_covered(case: Scored) -> bool:
    """Tell whether the 95 % interval of E holds the truth."""
    return _covers(case.answer.youngs_modulus, case.key.youngs_modulus)


def ratio_is_covered(case: Scored) -> bool:
    """Tell whether the 95 % interval of ν holds the truth."""
    return _covers(case.answer.poisson_ratio, case.key.poisson_ratio)


def _covers(told: Estimate | None, truth: float) -> bool:
    return told is not None and told.low <= truth <= told.high


def claims(cases: Sequence[Scored]) -> tuple[list[float], list[bool]]:
    """Return the probability of each leading answer, and whether it is right."""
    likeliest = [case.answer.likeliest for case in cases]
    right = [label in case.truths for case, (label, _) in zip(cases, likeliest, strict=True)]
    return [probability for _, probability in likeliest], right


def log_scores(cases: Sequence[Scored]) -> list[float]:
    """Return the natural logarithm of the probability of the truth in each case; what is impossible counts as 0.001.

    The mean is a proper score: it is best of all for whoever states what they believe (Gneiting & Raftery, J. Am. Stat.
    Assoc. 102 (2007) 359), but for that floor, without which one certain error would decide everything.
    """
    return [
        math.log(max(LEAST_PROBABILITY, *(case.answer.probabilities.get(one, 0.0) for one in case.truths)))
        for case in cases
    ]


def _calibration(cases: Cases) -> list[Metric]:
    asked = cases.with_one_answer
    confidence, right = claims(asked)
    seconds = [case.answer.seconds for case in cases.everything]
    return [
        Metric("log score: mean ln of the truth's probability", mean(log_scores(asked)), ""),
        Metric(
            f"calibration error ({CALIBRATION_BINS} bins)",
            calibration_error(confidence, right),
            "",
            calibration_error_by_chance(confidence),
        ),
        _share("90 % credible set holds the truth", asked, lambda c: c.truths[0] in c.answer.credible_set),
        Metric(
            "answers in a credible set, mean", mean([len(case.answer.credible_set) for case in asked]), ""
        ),
        Metric("time of a diagnosis, median", quantile(seconds, 50), "s"),
        Metric("time of a diagnosis, the slowest", quantile(seconds, 100), "s"),
    ]


def _doubles(cases: Cases) -> list[Metric]:
    doubles = cases.doubles
    return [
        _share("several causes: all named", doubles, all_are_named, _mean_ceiling(doubles)),
        _share("several causes: at least one", doubles, one_is_named),
        _share("several causes: a spurious one", doubles, lambda c: bool(_spurious(c))),
        _share("single cause: a spurious second", cases.singles, lambda c: c.is_right and bool(_spurious(c))),
    ]


def all_are_named(case: Scored) -> bool:
    """Tell whether every effect is in the verdict."""
    return set(case.key.effects) <= set(case.answer.verdict)


def one_is_named(case: Scored) -> bool:
    """Tell whether an effect at least is in the verdict."""
    return bool(set(case.key.effects) & set(case.answer.verdict))


def _spurious(case: Scored) -> set[str]:
    return set(case.answer.verdict) - {*case.key.effects, UNKNOWN}


def _share(
    name: str, cases: Sequence[Scored], holds: Callable[[Scored], bool], ceiling: float | None = None
) -> Metric:
    return Metric(name, share([holds(case) for case in cases]), "%", ceiling)
