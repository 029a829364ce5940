"""How far a refit goes."""

import typing

import numpy as np
import pytest

from estimator.diagnosis import refit as refitting
from estimator.diagnosis.case import Case, Linearisation
from estimator.diagnosis.hypothesis import Hypothesis, coordinates
from estimator.diagnosis.refit import refit

START = Hypothesis(15e3, 0.45)
NO_CASE = typing.cast(Case, None)


def points_solved(monkeypatch: pytest.MonkeyPatch, misfit: float, share_kept_of_a_promise: float) -> int:
    """How many points a refit solves of a problem whose steps do only a share of what their derivatives promise."""
    solved: list[Hypothesis] = []

    def linearise(case: Case, at: Hypothesis, near: Linearisation | None = None) -> Linearisation:
        solved.append(at)
        free = coordinates(at)
        gone = free[0].get(at) - free[0].get(START)
        residual = np.array([misfit - share_kept_of_a_promise * gone * misfit, 0.0])
        by_coordinate = np.diag([misfit, 1.0])
        return Linearisation(at, free, (), (residual,), (by_coordinate,), (), ())

    monkeypatch.setattr(refitting, "linearise", linearise)
    refit(NO_CASE, START, evaluations=20)
    return len(solved)


def test_where_nothing_is_promised_only_the_start_is_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    assert points_solved(monkeypatch, misfit=0.5, share_kept_of_a_promise=1.0) == 1


def test_a_step_that_keeps_its_promise_is_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    assert points_solved(monkeypatch, misfit=10.0, share_kept_of_a_promise=1.0) == 2


def test_steps_that_keep_half_of_it_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    assert points_solved(monkeypatch, misfit=10.0, share_kept_of_a_promise=0.5) > 3


def test_the_search_ends_where_a_step_gains_next_to_nothing_whatever_is_promised(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # A fall of 1.0 is promised, and one of 0.2 comes of it.
    assert points_solved(monkeypatch, misfit=2**0.5, share_kept_of_a_promise=0.1056) == 2
