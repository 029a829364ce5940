"""The diagnosis of bench tests: which cause opens the gap to a Neo-Hookean specimen."""

from collections.abc import Callable, Sequence

import numpy as np

from estimator.errors import InputError
from estimator.uniaxial.diagnosis.bench_test import BenchTest
from estimator.uniaxial.diagnosis.causes import NONE, UNKNOWN, forms_for, not_shown
from estimator.uniaxial.diagnosis.evidence import Weighed, specimen_with, weigh
from estimator.uniaxial.diagnosis.held_out import held_out
from estimator.uniaxial.diagnosis.likelihood import UNKNOWN_AMPLITUDES, Likelihood
from estimator.uniaxial.diagnosis.partings import parting_tests
from estimator.uniaxial.diagnosis.result import BenchDiagnosis, Course, Size
from estimator.uniaxial.diagnosis.rows import Rows, rows_of
from estimator.uniaxial.diagnosis.specimen import stress_per_modulus
from estimator.uniaxial.diagnosis.verdict import Answer, Ranking, named, ranked

_FEWEST_ROWS = 12
_LEAST_CLOSURE = 0.25
_NO_CAUSE: tuple[Answer, ...] = ((NONE,), (UNKNOWN,))
_SMALLER = (0.0, 1.0, 2.0, 4.0)  # prior deviations by which a second cause may be less than alone
Tell = Callable[[str, int, int], None]


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
    rows = [rows_of(test) for test in tests]
    forms = forms_for(rows)
    if not forms:
        raise InputError("strain does not change and there is no time; nothing can be told from such tests")
    likelihood = Likelihood(rows)
    plain, unknown = weigh((), likelihood), weigh((), likelihood, UNKNOWN_AMPLITUDES)
    if plain is None or unknown is None:
        raise InputError(
            "stress does not rise with strain; check which columns hold load and travel, and --mode"
        )
    labels = tuple(dict.fromkeys(form.label for form in forms))
    weighed = [plain]
    for number, form in enumerate(forms):
        _progress(tell, "weighing causes", number, len(forms))
        weighed.extend(_possible(weigh((form,), likelihood)))
    ranking = ranked(weighed, unknown, labels)
    if ranking.leader != (NONE,):
        weighed.extend(_pairs(weighed[1:], likelihood, tell))
        ranking = ranked(weighed, unknown, labels)
    _progress(tell, "holding against what is left out", 0, 1)
    return _concluded(tests, rows, ranking)


def _progress(tell: Tell | None, text: str, done: int, total: int) -> None:
    if tell is not None:
        tell(text, done, total)


def _possible(one: Weighed | None) -> list[Weighed]:
    return [] if one is None else [one]


def _pairs(singles: Sequence[Weighed], likelihood: Likelihood, tell: Tell | None) -> list[Weighed]:
    """Weigh the best cause together with the best form of every other."""
    best: dict[str, Weighed] = {}
    for one in sorted(singles, key=lambda one: -one.log_evidence):
        best.setdefault(one.labels[0], one)
    first, *others = best.values()
    found = []
    for number, second in enumerate(others):
        _progress(tell, "weighing pairs of causes", number, len(others))
        size = np.eye(len(second.z))[0]
        starts = [np.concatenate([first.z, second.z - less * size]) for less in _SMALLER]
        found.extend(_possible(weigh((*first.forms, *second.forms), likelihood, starts=starts)))
    return found


def _concluded(tests: Sequence[BenchTest], rows: Sequence[Rows], ranking: Ranking) -> BenchDiagnosis:
    verdict, plausible = ranking.shared, ranking.plausible
    nearest = verdict if verdict in plausible else ranking.leader
    if nearest == (UNKNOWN,):
        nearest = next(one for one in ranking.probabilities if one not in _NO_CAUSE)
    best, plain = ranking.best[nearest], ranking.best[(NONE,)]
    left = held_out(best, rows)
    rejected = verdict not in _NO_CAUSE and left.closure < _LEAST_CLOSURE
    if rejected:
        verdict, plausible = (UNKNOWN,), ((UNKNOWN,),)
    alike = tuple(one for one in plausible if one != verdict)
    every = tuple(label for answer in (verdict, *alike) for label in answer)
    return BenchDiagnosis(
        tests=tuple(tests),
        verdict=verdict,
        alike=alike,
        ranking=ranking,
        nearest=nearest,
        rejected=rejected,
        sizes=() if verdict in _NO_CAUSE else _sizes(best),
        modulus_before=(plain.modulus, plain.modulus_std),
        modulus_after=_averaged(ranking, nearest),
        held_out=left,
        next_tests=tuple(parting_tests(every)) if alike or verdict == (UNKNOWN,) else (),
        not_tried=tuple(f"{named((label,))}: {why}" for label, why in not_shown(rows).items()),
        courses=tuple(Course(one, _stress(plain, one), _stress(best, one)) for one in rows),
    )


def _stress(weighed: Weighed, rows: Rows) -> np.typing.NDArray[np.float64]:
    return weighed.modulus * stress_per_modulus(specimen_with(weighed.forms, weighed.z), rows)


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


def _averaged(ranking: Ranking, answer: Answer) -> tuple[float, float]:
    """Return E of an answer with the spread of all (J. A. Hoeting et al., Stat. Sci. 14 (1999) 382)."""
    modulus = ranking.best[answer].modulus
    variance = sum(
        p * (ranking.best[one].modulus_std ** 2 + (ranking.best[one].modulus - modulus) ** 2)
        for one, p in ranking.probabilities.items()
    )
    return modulus, float(np.sqrt(variance))
