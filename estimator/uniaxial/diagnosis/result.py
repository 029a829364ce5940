"""What a diagnosis of bench tests has found."""

from dataclasses import dataclass

from estimator.uniaxial.diagnosis.bench_test import BenchTest
from estimator.uniaxial.diagnosis.held_out import HeldOut
from estimator.uniaxial.diagnosis.rows import Rows
from estimator.uniaxial.diagnosis.verdict import Answer, Ranking
from estimator.uniaxial.records import FloatArray


@dataclass(frozen=True, slots=True)
class Size:
    """A parameter of a cause, with the interval of one deviation."""

    label: str
    name: str
    unit: str
    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """One test with what was fitted to all of it.

    Attributes
    ----------
    rows : as they were averaged
    before, after : (n,) stress of the Neo-Hookean law alone, and with the causes that come nearest, Pa
    """

    rows: Rows
    before: FloatArray
    after: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class BenchDiagnosis:
    """What opens the gap.

    Attributes
    ----------
    tests : as they were read
    verdict : the cause or causes that all plausible answers have in common; or the leader, "none" or "unknown"
    alike : the other plausible answers, which the tests do not tell from it
    ranking : all answers with their probabilities
    nearest : the causes that were held against what was left out: of the verdict, or by "unknown" the most probable
    rejected : whether these fit best and do not predict what was left out, which makes the verdict "unknown"
    sizes : of the nearest causes; nothing by "none" and "unknown"
    modulus_before, modulus_after : E and its deviation, Pa
    held_out : the gap where nothing was fitted
    next_tests : that would part what is alike
    not_tried : causes that these tests cannot show, and why
    courses : the tests with what was fitted
    """

    tests: tuple[BenchTest, ...]
    verdict: Answer
    alike: tuple[Answer, ...]
    ranking: Ranking
    nearest: Answer
    rejected: bool
    sizes: tuple[Size, ...]
    modulus_before: tuple[float, float]
    modulus_after: tuple[float, float]
    held_out: HeldOut
    next_tests: tuple[str, ...]
    not_tried: tuple[str, ...]
    courses: tuple[Course, ...]
