"""What the data do not say, in words."""

from synthetic_diagnoses import finding

from estimator.diagnosis.conclusions.open_questions import measurements, what_cannot_be_told
from estimator.diagnosis.result import Quantity
from estimator.diagnosis.search.decision import Doubted
from estimator.effects.catalogue import default_catalogue


def sentence(**sizes: Quantity) -> str:
    """What is said of an effect that these sizes would show."""
    return what_cannot_be_told(
        {"gravity_sag": finding("gravity_sag", "support", state="cannot_tell", detectable=sizes)}, (), {}
    )[-1]


def test_few_sizes_are_told_one_by_one() -> None:
    told = sentence(fx=Quantity(0.02, 0.0, "N"), fy=Quantity(0.01, 0.0, "N"), tx=Quantity(3e-4, 0.0, "N·m"))
    assert told == "gravity_sag would not show: fx below 0.02 N, fy below 0.01 N, tx below 0.0003 N·m."


def test_of_many_sizes_of_a_unit_the_least_and_the_largest_are_told() -> None:
    told = sentence(
        a=Quantity(0.2, 0.0, "1"),
        b=Quantity(0.1, 0.0, "1"),
        c=Quantity(9.0, 0.0, "1"),
        d=Quantity(1.0, 0.0, "1"),
    )
    assert told == "gravity_sag would not show: 4 sizes, from b below 0.1 to c below 9."


def test_where_several_answers_remain_they_are_named() -> None:
    assert "These data do not decide between none and gravity_sag." in what_cannot_be_told(
        {}, ("none", "gravity_sag"), {}
    )


def test_a_second_cause_that_is_not_named_is_told_with_what_it_lacks() -> None:
    doubt = Doubted("grasp_misplacement", adds=5.33, asked=6.5)
    told = what_cannot_be_told({}, (), {}, [doubt])[-1]
    assert told == (
        "grasp_misplacement may be a second cause: it raises the log evidence by 5.3, where 6.5 are asked."
    )


def test_what_would_tell_an_effect_is_said_where_its_effect_declares_it() -> None:
    unseen = {"thickness_error": finding("thickness_error", "geometry", state="cannot_tell", detectable={})}
    told = what_cannot_be_told(unseen, (), measurements(default_catalogue()))
    assert told[-1].endswith("measure the phantom's thickness with a calliper.")
