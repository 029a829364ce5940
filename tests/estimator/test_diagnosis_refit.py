"""How far a refit goes."""

import numpy as np
import pytest
from bare_contexts import bare_case

from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.fitting.refit import refit
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import is_determined

START = Hypothesis(15e3, 0.45)
NO_CASE = bare_case()


class Problem:
    """A problem whose steps do only a share of what their derivatives promise."""

    def __init__(self, misfit: float, share_kept_of_a_promise: float) -> None:
        self.misfit, self.share = misfit, share_kept_of_a_promise
        self.gone: list[float] = []

    def solve(self, case: Case, at: Hypothesis, near: Linearisation | None) -> Linearisation:
        free = free_parameters(at)
        gone = free[0].internal - free[0].of(START).internal
        self.gone.append(gone)
        residual = np.array([self.misfit - self.share * gone * self.misfit, 0.0])
        return Linearisation(at, free, (), (residual,), (np.diag([self.misfit, 1.0]),), (), ())


def points_solved(misfit: float, share_kept_of_a_promise: float, worthwhile: float = 0.3) -> int:
    """How many points a refit solves of such a problem."""
    problem = Problem(misfit, share_kept_of_a_promise)
    refit(NO_CASE, START, evaluations=20, solve=problem.solve, worthwhile=worthwhile)
    return len(problem.gone)


def test_where_nothing_is_promised_only_the_start_is_solved() -> None:
    assert points_solved(misfit=0.5, share_kept_of_a_promise=1.0) == 1


def test_a_step_that_keeps_its_promise_is_the_last() -> None:
    assert points_solved(misfit=10.0, share_kept_of_a_promise=1.0) == 2


def test_steps_that_keep_half_of_it_go_on() -> None:
    assert points_solved(misfit=10.0, share_kept_of_a_promise=0.5) > 3


def test_the_search_ends_where_a_step_gains_next_to_nothing_whatever_is_promised() -> None:
    # A fall of 1.0 is promised, and one of 0.2 comes of it.
    assert points_solved(misfit=2**0.5, share_kept_of_a_promise=0.1056) == 2


def test_where_less_matters_less_is_followed_and_the_rest_later() -> None:
    problem = Problem(misfit=10.0, share_kept_of_a_promise=0.5)
    roughly = refit(NO_CASE, START, evaluations=20, solve=problem.solve, worthwhile=5.0)
    few = len(problem.gone)
    assert few < points_solved(misfit=10.0, share_kept_of_a_promise=0.5)
    polished = refit(NO_CASE, roughly.hypothesis, roughly, evaluations=20, solve=problem.solve)
    assert polished.chi2 < roughly.chi2
    assert len(problem.gone) == points_solved(misfit=10.0, share_kept_of_a_promise=0.5)


def test_a_refit_goes_on_with_the_share_of_a_step_that_was_not_tried_yet() -> None:
    worse_and_worse = Problem(misfit=10.0, share_kept_of_a_promise=-1.0)
    stopped = refit(NO_CASE, START, evaluations=2, solve=worse_and_worse.solve)
    ended = refit(NO_CASE, START, stopped, evaluations=20, solve=worse_and_worse.solve)
    refit(NO_CASE, START, ended, evaluations=20, solve=worse_and_worse.solve)
    _, whole, *shorter = worse_and_worse.gone
    assert [gone / whole for gone in shorter] == pytest.approx([1 / 3, 1 / 9])


@pytest.mark.parametrize(("depends", "determined"), [(1.0, True), (1e-6, True), (0.0, False)])
def test_a_refit_in_which_nothing_tells_of_the_modulus_is_no_candidate(
    depends: float, determined: bool
) -> None:
    free = free_parameters(START)
    jacobian = np.array([[depends, 1.0], [depends, -1.0]])
    fit = Linearisation(START, free, (), (np.ones(2),), (jacobian,), (), ())
    assert is_determined(fit) is determined
