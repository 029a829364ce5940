"""Errors of instruments that are others in each experiment."""

import numpy as np
import pytest
from effect_cases import YAW, at_null, felt, there_and_back, three_experiments, with_values
from numpy.testing import assert_allclose

from estimator.effects.catalogue import CATALOGUE
from estimator.effects.effect import Effect, Motion, Values
from estimator.effects.force.force_axis_gain import ForceAxisGain, ForceAxisGainOfEach
from estimator.effects.shared.of_each_experiment import OfEachExperiment
from estimator.effects.shared.sensor_steps import sensor_steps_of
from estimator.inference.channels import side_by_side

FloatArray = np.ndarray

ALL = [effect for effect in CATALOGUE if isinstance(effect, OfEachExperiment)]
LABELS = {
    "camera_rotation",
    "camera_scale",
    "force_axis_gain",
    "force_frame_rotation",
    "motion_direction",
    "motion_scale",
    "time_offset",
    "tool_weight",
    "torque_centre",
}


def change(effect: Effect, motion: Motion, values: Values) -> FloatArray:
    """What an effect changes of poses and readings."""
    moved = effect.motion(motion, values)
    read, plain = effect.readings(felt(motion), values), felt(motion)
    return np.hstack(
        [
            moved.position - motion.position,
            side_by_side(read.wrench, read.fiducials) - side_by_side(plain.wrench, plain.fiducials),
        ]
    )


def test_every_instrument_that_is_set_anew_has_such_a_form() -> None:
    assert {effect.label for effect in ALL} == LABELS


@pytest.mark.parametrize("effect", ALL, ids=lambda effect: effect.name)
def test_each_experiment_feels_its_own_size_alone(effect: OfEachExperiment) -> None:
    for order in (1, 2, 3):
        motion = there_and_back(order, YAW)
        for amplitude in effect.amplitudes:
            found = change(effect, motion, with_values(effect, {amplitude.name: amplitude.scale}))
            plain = amplitude.name.rpartition("_in_experiment_")
            own = with_values(effect.single, {plain[0]: amplitude.scale})
            expected = change(effect.single, motion, own) if plain[2] == str(order) else 0.0
            assert_allclose(found, expected * np.ones_like(found), atol=1e-15)


@pytest.mark.parametrize("effect", ALL, ids=lambda effect: effect.name)
def test_sizes_that_are_alike_are_the_plain_form(effect: OfEachExperiment) -> None:
    own = {one.name: one.scale for one in effect.single.amplitudes}
    alike = {f"{name}_in_experiment_{order}": size for name, size in own.items() for order in (1, 2, 3)}
    for order in (1, 2, 3):
        motion = there_and_back(order, YAW)
        assert_allclose(change(effect, motion, alike), change(effect.single, motion, own), atol=1e-15)


@pytest.mark.parametrize("effect", ALL, ids=lambda effect: effect.name)
def test_an_experiment_without_a_size_is_as_it_was(effect: OfEachExperiment) -> None:
    fourth = there_and_back(4, YAW)
    assert not change(effect, fourth, {one.name: one.scale for one in effect.amplitudes}).any()
    assert not change(effect, fourth, at_null(effect)).any()


def test_it_is_looked_for_with_a_size_for_each_experiment_that_there_is() -> None:
    experiments = [each.experiment for each in three_experiments()]
    five = [there_and_back(order).experiment for order in (5, 2, 1, 7, 7)]
    effect = ForceAxisGainOfEach(ForceAxisGain("fy"))
    assert [one.name for one in effect.looked_for_in(experiments).amplitudes] == [
        "gain_in_experiment_1",
        "gain_in_experiment_2",
        "gain_in_experiment_3",
    ]
    names = [one.name for one in effect.looked_for_in(five).amplitudes]
    assert names == [
        "gain_in_experiment_1",
        "gain_in_experiment_2",
        "gain_in_experiment_5",
        "gain_in_experiment_7",
    ]
    assert effect.looked_for_in(five).name == effect.name
    plain = ForceAxisGain("fy")
    assert plain.looked_for_in(five) is plain


def test_readings_are_told_in_steps_by_the_plain_form_too() -> None:
    class Untold(ForceAxisGain):
        sensor_steps = None

    assert ForceAxisGainOfEach(ForceAxisGain("fy")).single.name == "force_axis_gain:fy"
    with pytest.raises(TypeError, match="give it sensor_steps"):
        ForceAxisGainOfEach(Untold("fy"))


def test_it_tells_the_steps_of_the_experiment_that_it_is_asked_for() -> None:
    effect, experiment = ForceAxisGainOfEach(ForceAxisGain("fy")), there_and_back(2).experiment
    given = with_values(effect, {"gain_in_experiment_1": 0.3, "gain_in_experiment_2": 0.1})
    assert sensor_steps_of(effect, experiment, given) == sensor_steps_of(
        effect.single, experiment, {"gain": 0.1}
    )
