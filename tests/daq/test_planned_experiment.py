"""The rows that a trajectory is laid out to."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.frames import IDENTITY
from daq.trajectories import STANDARD_SPEED, Step, Trajectory
from daq.trajectories.planned import planned_experiment
from daq.trajectories.routines import NAMED
from daq.virtual_rig.layout import SPECIMEN
from estimator.experiment import Experiment, SensorNoise
from robot_drivers.protocols import Pose

DWELLS_S = st.sampled_from([0.0, 1e-12, 0.3, 30.0])
STEPS = st.builds(
    lambda x_m, settle_s, measure_s: Step(1, "hold", Pose((x_m, 0.0, 0.0)), settle_s, measure_s),
    st.sampled_from([0.0, 1e-18, 0.1 + 0.2, 0.3, 0.004]),
    DWELLS_S,
    DWELLS_S,
)


def planned(trajectory: Trajectory) -> Experiment:
    return planned_experiment(trajectory, SPECIMEN, SensorNoise(0.02, 5e-4, 5e-5, 3e-5), order=1)


@pytest.mark.parametrize("name", NAMED)
def test_the_times_of_a_named_trajectory_ascend(name: str) -> None:
    assert np.diff(planned(NAMED[name]()).time).min() > 1e-3


@given(st.lists(STEPS, max_size=8))
@settings(deadline=None)
def test_times_ascend_whatever_is_passed_through_or_stood_at(steps: list[Step]) -> None:
    rest = Step(0, "hold", IDENTITY, 0.3, 1.0)
    experiment = planned(Trajectory("mine", STANDARD_SPEED, (rest, *steps)))
    assert np.all(np.diff(experiment.time) > 0)
    stood_s = sum(step.settle_s + step.measure_s for step in steps)
    assert experiment.time[-1] >= stood_s - 1e-9


def test_a_step_that_is_passed_through_is_met_once_on_the_way() -> None:
    rest = Step(0, "hold", IDENTITY, 0.3, 1.0)
    passed = Step(1, "hold", Pose((0.004, 0.0, 0.0)), 0.0, 0.0)
    stop = Step(2, "hold", Pose((0.008, 0.0, 0.0)), 0.3, 0.5)
    experiment = planned(Trajectory("mine", STANDARD_SPEED, (rest, passed, stop)))
    assert experiment.phase == ("hold", "ramp", "ramp", "ramp", "ramp", "hold")
    np.testing.assert_array_equal(experiment.step, [0, 1, 1, 2, 2, 2])
    way_m = experiment.position[:, 0] - SPECIMEN.grasp.centre[0]
    np.testing.assert_allclose(way_m, [0.0, 0.002, 0.004, 0.006, 0.008, 0.008], atol=1e-12)
