"""A diagnosis of bench tests in words, and as plain types for JSON."""

from typing import Any

from estimator.uniaxial.diagnosis.causes import NONE, UNKNOWN
from estimator.uniaxial.diagnosis.result import BenchDiagnosis, Size
from estimator.uniaxial.diagnosis.verdict import Answer, named

_LEAST_SHOWN = 0.005


def as_json(found: BenchDiagnosis) -> dict[str, Any]:
    """Return plain types for ``json.dumps``; SI units."""
    held = found.held_out
    labels = dict.fromkeys(label for answer in found.ranking.probabilities for label in answer)
    return {
        "verdict": list(found.verdict),
        "alike": [list(one) for one in found.alike],
        "probabilities": {label: found.ranking.probability_of(label) for label in labels},
        "answers": [
            {"causes": list(answer), "probability": p} for answer, p in found.ranking.probabilities.items()
        ],
        "sizes": [
            {
                "cause": s.label,
                "name": s.name,
                "unit": s.unit,
                "value": s.value,
                "interval68": [s.low, s.high],
            }
            for s in found.sizes
        ],
        "youngs_modulus": {
            "before": {"value": found.modulus_before[0], "std": found.modulus_before[1]},
            "after": {"value": found.modulus_after[0], "std": found.modulus_after[1]},
        },
        "held_out": {
            "what": held.what,
            "gap_before": held.gap_before,
            "gap_after": held.gap_after,
            "noise": held.noise,
            "closure": held.closure,
        },
        "nearest": list(found.nearest),
        "rejected": found.rejected,
        "next_tests": list(found.next_tests),
        "not_tried": list(found.not_tried),
        "tests": [
            {
                "name": test.name,
                "path": None if test.path is None else str(test.path),
                "mode": test.mode,
                "rows": len(test.strain),
                "found": list(test.found),
                "assumed": list(test.assumed),
                "left_out": list(test.left_out),
            }
            for test in found.tests
        ],
    }


def as_text(found: BenchDiagnosis) -> str:
    """Return the verdict, the probabilities and how the tests were read."""
    lines = [summary(found), ""]
    lines += [f"  {round(100 * p):3d} %  {named(answer)}" for answer, p in shown(found)]
    lines += ["", *(_size(size) for size in found.sizes), moduli(found), closure(found)]
    if found.next_tests:
        lines += ["What would tell more:", *(f"- {test}" for test in found.next_tests)]
    lines += [f"not tried: {one}" for one in found.not_tried]
    for test in found.tests:
        lines.append(f"{test.name}: {test.mode}, {len(test.strain)} rows")
        lines += [f"  assumed: {one}" for one in test.assumed]
        lines += [f"  left out: {one}" for one in test.left_out]
    return "\n".join(lines)


def summary(found: BenchDiagnosis) -> str:
    """Return the verdict in one sentence."""
    nearest = named(found.nearest)
    if found.rejected:
        return (
            f"Unknown: {nearest} fits best, and does not predict {found.held_out.what} left out of the fit."
        )
    if found.verdict == (NONE,):
        return "None: a Neo-Hookean law explains the tests."
    if found.verdict == (UNKNOWN,) and not found.alike:
        return f"Unknown: nothing that was tried explains the gap well; {nearest} comes nearest."
    if not all(label in answer for answer in found.alike for label in found.verdict):
        return f"Cannot tell between {' and '.join(named(one) for one in (found.verdict, *found.alike))}."
    causes = f"{named(found.verdict).capitalize()} causes the gap to a Neo-Hookean law"
    if not found.alike:
        return f"{causes}."
    others = [tuple(label for label in one if label not in found.verdict) for one in found.alike]
    parts = " or ".join(named(one) for one in others)
    return f"{causes}{'; ' if found.nearest == found.verdict else ', together with '}{parts}" + (
        " may have a part in it." if found.nearest == found.verdict else "."
    )


def shown(found: BenchDiagnosis) -> list[tuple[Answer, float]]:
    """Return the answers that have half a percent or more."""
    return [(answer, p) for answer, p in found.ranking.probabilities.items() if p >= _LEAST_SHOWN]


def moduli(found: BenchDiagnosis) -> str:
    """Return Young's modulus before and after."""
    before, after = found.modulus_before, found.modulus_after
    return (
        f"E before: {before[0] / 1e3:.4g} ± {before[1] / 1e3:.2g} kPa; after: {after[0] / 1e3:.4g} ± "
        f"{after[1] / 1e3:.2g} kPa"
    )


def closure(found: BenchDiagnosis) -> str:
    """Return how far the gap closes where nothing was fitted."""
    held = found.held_out
    if found.nearest == (NONE,):
        return f"Held out ({held.what}): the gap is {100 * held.gap_before:.3g} % of the stress"
    return (
        f"Held out ({held.what}): {named(found.nearest)} brings the gap from {100 * held.gap_before:.3g} % to "
        f"{100 * held.gap_after:.3g} % of the stress, {round(100 * held.closure)} % of what is above the noise"
    )


def _size(size: Size) -> str:
    return (
        f"{size.label.replace('_', ' ')}: {size.name.replace('_', ' ')} {size.value:.3g} "
        f"({size.low:.3g} to {size.high:.3g}) {size.unit}".rstrip()
    )
