"""Which pairs of causes are looked at once more."""

import typing

import numpy as np

from estimator.diagnosis.case import Linearisation
from estimator.diagnosis.contest import Contender
from estimator.diagnosis.hypothesis import Hypothesis
from estimator.diagnosis.pair_search import distinct_forms, without_vanished
from estimator.effects.catalogue import CATALOGUE

MATERIAL = Hypothesis(15e3, 0.45)


def beside(present: Hypothesis, name: str, size: float) -> Hypothesis:
    """A hypothesis with one effect more, of some size for each amplitude."""
    effect = next(one for one in CATALOGUE if one.name == name)
    constants = {constant.name: constant.lower for constant in effect.constants}
    return present.with_effect(effect, {**constants, **{one.name: size for one in effect.amplitudes}})


def contender(hypothesis: Hypothesis, evidence: float) -> Contender:
    fit = Linearisation(hypothesis, (), (), (), (), typing.cast(typing.Any, None), ())
    return Contender(fit, evidence, np.zeros(0))


def test_a_second_start_of_one_form_is_no_second_leader() -> None:
    sphere = beside(MATERIAL, "inhomogeneity:sphere", 0.2)
    cylinder = beside(MATERIAL, "inhomogeneity:cylinder", 0.2)
    field = [contender(sphere, 90.0), contender(sphere, 89.0), contender(cylinder, 80.0)]
    assert [one.log_evidence for one in distinct_forms(field)] == [90.0, 80.0]


def test_what_a_vanished_effect_has_led_on_stands_alone() -> None:
    loose = beside(MATERIAL, "anchor_debonding", 0.25)
    (alone,) = without_vanished(beside(loose, "inhomogeneity:sphere", 1e-5))
    assert alone == loose


def test_a_pair_of_which_neither_vanished_stays_a_pair() -> None:
    loose = beside(MATERIAL, "anchor_debonding", 0.25)
    assert not without_vanished(beside(loose, "inhomogeneity:sphere", 0.3))
