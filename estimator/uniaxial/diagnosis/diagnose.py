"""The diagnosis of bench tests: which cause opens the gap to a Neo-Hookean specimen."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from estimator.errors import InputError
from estimator.uniaxial.diagnosis.bench_test import BenchTest
from estimator.uniaxial.diagnosis.causes import NONE, UNKNOWN, forms_for
from estimator.uniaxial.diagnosis.evidence import Weighed, weigh
from estimator.uniaxial.diagnosis.held_out import HeldOut, held_out
from estimator.uniaxial.diagnosis.likelihood import UNKNOWN_AMPLITUDES, Likelihood
from estimator.uniaxial.diagnosis.partings import parting_tests
from estimator.uniaxial.diagnosis.rows import Rows, rows_of
from estimator.uniaxial.diagnosis.verdict import LEAST_CLOSURE, Answer, Ranking, ranked

_FEWEST_ROWS = 12
Tell = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class Size:
    """A parameter of a cause, with the interval of one deviation."""

    label: str
    name: str
    unit: str
    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class BenchDiagnosis:
    """What opens the gap.

    Attributes
    ----------
    tests : as they were read
    verdict : the cause or causes, "none" or "unknown"
    alike : answers that the tests do not tell from it
    ranking : all answers with their probabilities
    sizes : of what is named
    modulus_before, modulus_after : E and its deviation, Pa
    held_out : the gap where nothing was fitted, for what is named or, with "unknown", was most probable
    rejected : a cause that fits, and does not predict what was left out
    next_tests : that would part what is alike
    not_tried : causes that these tests cannot show, and why
    """

    tests: tuple[BenchTest, ...]
    verdict: Answer
    alike: tuple[Answer, ...]
    ranking: Ranking
    sizes: tuple[Size, ...]
    modulus_before: tuple[float, float]
    modulus_after: tuple[float, float]
    held_out: HeldOut
    rejected: Answer | None
    next_tests: tuple[str, ...]
    not_tried: tuple[str, ...]
    rows: tuple[Rows, ...]
    named: Weighed


def diagnose_bench(tests: Sequence[BenchTest], tell: Tell | None = None) -> BenchDiagnosis:
    """Diagnose bench tests of one material.

    Raises
    ------
    InputError
        A test has too few rows, or stress does not rise with strain.
    """
    for test in tests:
        if len(test.strain) < _FEWEST_ROWS:
            raise InputError(
                f"{test.name}: {len(test.strain)} rows; a diagnosis needs {_FEWEST_ROWS} or more"
            )
    reduced = [rows_of(test) for test in tests]
    likelihood = Likelihood(reduced)
    plain, unknown = weigh((), likelihood), weigh((), likelihood, UNKNOWN_AMPLITUDES)
    if plain is None or unknown is None:
        raise InputError(
            "stress does not rise with strain; check which columns hold load and travel, and --mode"
        )
    forms = forms_for(reduced)
    labels = tuple(dict.fromkeys(form.label for form in forms))
    weighed = [plain]
    for number, form in enumerate(forms):
        if tell is not None:
            tell("weighing causes", number, len(forms))
        one = weigh((form,), likelihood)
        if one is not None:
            weighed.append(one)
    weighed.extend(_pairs(weighed, likelihood, tell))
    ranking = ranked(weighed, unknown, labels)
    return _concluded(tests, reduced, ranking, plain, labels)


def _pairs(weighed: Sequence[Weighed], likelihood: Likelihood, tell: Tell | None) -> list[Weighed]:
    """Weigh the best cause together with the best form of every other."""
    best: dict[str, Weighed] = {}
    for one in weighed[1:]:
        label = one.labels[0]
        if label not in best or one.log_evidence > best[label].log_evidence:
            best[label] = one
    order = sorted(best.values(), key=lambda one: -one.log_evidence)
    found = []
    for number, second in enumerate(order[1:]):
        if tell is not None:
            tell("weighing pairs of causes", number, len(order) - 1)
        starts = [
            np.concatenate([order[0].z, z]) for z in (second.z, second.z - 1, second.z + 1, 0 * second.z)
        ]
        both = weigh((*order[0].forms, *second.forms), likelihood, starts=starts)
        if both is not None:
            found.append(both)
    return found


def _concluded(
    tests: Sequence[BenchTest],
    rows: Sequence[Rows],
    ranking: Ranking,
    plain: Weighed,
    labels: tuple[str, ...],
) -> BenchDiagnosis:
    verdict, rejected = ranking.leader, None
    best = ranking.best[verdict]
    if verdict == (UNKNOWN,):
        causes = [one for one in ranking.probabilities if one not in ((NONE,), (UNKNOWN,))]
        best = ranking.best[causes[0]]
    closed = held_out(best, rows)
    if verdict not in ((NONE,), (UNKNOWN,)) and closed.closure < LEAST_CLOSURE:
        verdict, rejected = (UNKNOWN,), verdict
    alike = () if rejected else ranking.alike
    named = () if verdict in ((NONE,), (UNKNOWN,)) else _sizes(best)
    every = tuple(label for answer in (verdict, *alike) for label in answer)
    return BenchDiagnosis(
        tests=tuple(tests),
        verdict=verdict,
        alike=alike,
        ranking=ranking,
        sizes=named,
        modulus_before=(plain.modulus, plain.modulus_std),
        modulus_after=_averaged(ranking),
        held_out=closed,
        rejected=rejected,
        next_tests=tuple(parting_tests(every)) if alike or verdict == (UNKNOWN,) else (),
        not_tried=_not_tried(tests, labels),
        rows=tuple(rows),
        named=best if named else plain,
    )


def _sizes(best: Weighed) -> tuple[Size, ...]:
    found, place = [], 0
    spread = np.sqrt(np.diag(best.covariance))
    for form in best.forms:
        for prior in form.priors:
            z, std = float(best.z[place]), float(spread[place])
            ends = (prior.value(z - std), prior.value(z + std))
            found.append(Size(form.label, prior.name, prior.unit, prior.value(z), min(ends), max(ends)))
            place += 1
    return tuple(found)


def _averaged(ranking: Ranking) -> tuple[float, float]:
    """Return E of the leader with the spread of all answers (J. A. Hoeting et al., Stat. Sci. 14 (1999) 382)."""
    leader = ranking.best[ranking.leader]
    variance = sum(
        p * (ranking.best[one].modulus_std ** 2 + (ranking.best[one].modulus - leader.modulus) ** 2)
        for one, p in ranking.probabilities.items()
        if np.isfinite(ranking.best[one].modulus_std)
    )
    return leader.modulus, float(np.sqrt(variance))


def _not_tried(tests: Sequence[BenchTest], labels: tuple[str, ...]) -> tuple[str, ...]:
    reasons = {
        "viscoelasticity": "a test has no column of time",
        "machine_compliance": "strain was measured on the specimen",
        "clamp_slip": "platens have no clamps, or strain was measured on the specimen",
        "platen_friction": "no test is a compression",
    }
    return tuple(f"{label}: {why}" for label, why in reasons.items() if label not in labels)
