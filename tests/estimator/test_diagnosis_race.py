"""Which hypotheses are refitted further."""

import typing

import numpy as np

from estimator.diagnosis.case import Linearisation
from estimator.diagnosis.contest import Contender
from estimator.diagnosis.race import finalists


def contenders(*evidence: float) -> list[Contender]:
    fit = typing.cast(Linearisation, None)
    return [Contender(fit, value, np.zeros(0)) for value in evidence]


def reached(*evidence: float, bar: float = 0.0) -> list[float]:
    return [one.log_evidence for one in finalists(contenders(*evidence), bar)]


def test_rivals_near_the_best_go_on_and_those_far_behind_do_not() -> None:
    assert reached(40.0, 33.0, 29.0) == [40.0, 33.0]


def test_where_much_is_explained_more_of_them_count_as_near() -> None:
    assert reached(1000.0, 880.0, 840.0) == [1000.0, 880.0]


def test_at_most_three_go_on() -> None:
    assert reached(40.0, 39.0, 38.0, 37.0) == [40.0, 39.0, 38.0]


def test_nobody_goes_on_who_remains_far_below_the_bar() -> None:
    assert reached(90.0, 85.0, bar=110.0) == []
    assert reached(105.0, 96.0, bar=110.0) == [105.0]
