import math
from dataclasses import replace

import numpy as np
import pytest

from daq.errors import TrajectoryError
from daq.trajectories import GRADUAL_TANGENT_PULL, PULL, STANDARD, TWIST_AND_PULL, Dwell, Retraction
from robot_drivers.protocols import Pose


def outward(retraction: Retraction) -> list[Pose]:
    return [step.T_rest_gripper for step in retraction.trajectory().steps if step.phase == "hold"]


def test_a_pull_goes_ten_times_two_millimetres_along_x() -> None:
    poses = outward(PULL)
    np.testing.assert_allclose(
        [pose.position for pose in poses], [(0.002 * n, 0, 0) for n in range(11)], atol=1e-15
    )
    assert all(pose.quaternion_wxyz == (1.0, 0.0, 0.0, 0.0) for pose in poses)


def test_a_gradual_tangent_pull_turns_about_z_to_thirty_degrees() -> None:
    poses = outward(GRADUAL_TANGENT_PULL)
    assert len(poses) == 21
    assert poses[-1].position == pytest.approx((0.02, 0, 0))
    angle = math.radians(15)
    assert poses[-1].quaternion_wxyz == pytest.approx((math.cos(angle), 0, 0, math.sin(angle)))
    assert poses[10].quaternion_wxyz == pytest.approx((math.cos(angle / 2), 0, 0, math.sin(angle / 2)))


def test_a_twist_and_pull_turns_about_x_to_forty_five_degrees() -> None:
    last = outward(TWIST_AND_PULL)[-1]
    assert last.position == pytest.approx((0.02, 0, 0))
    angle = math.radians(22.5)
    assert last.quaternion_wxyz == pytest.approx((math.cos(angle), math.sin(angle), 0, 0))


@pytest.mark.parametrize("retraction", STANDARD.values(), ids=STANDARD)
def test_every_retraction_begins_and_ends_at_rest(retraction: Retraction) -> None:
    steps = retraction.trajectory().steps
    for step in (steps[0], steps[-1]):
        assert step.T_rest_gripper.position == pytest.approx((0, 0, 0), abs=1e-15)
        assert step.T_rest_gripper.quaternion_wxyz == pytest.approx((1, 0, 0, 0))
    assert [step.number for step in steps] == list(range(len(steps)))
    assert [step.phase for step in steps[-5:]] == ["return_hold"] * 5


def test_holds_measure_again_at_the_last_step() -> None:
    held = replace(PULL, dwell=Dwell(settle_s=0.5, measure_s=0.8, holds_s=(3.0, 8.0)), return_steps=0)
    *_, last, first_hold, second_hold = held.trajectory().steps
    assert last.number == first_hold.number == second_hold.number == 10
    assert first_hold.T_rest_gripper == last.T_rest_gripper
    begins = np.cumsum([last.measure_s + first_hold.settle_s, first_hold.measure_s + second_hold.settle_s])
    assert begins.tolist() == pytest.approx([3.0, 8.0])


def test_a_hold_that_begins_before_the_window_before_it_ends_is_refused() -> None:
    with pytest.raises(TrajectoryError, match=r"hold at 0\.5 s"):
        replace(PULL, dwell=Dwell(measure_s=0.8, holds_s=(0.5,))).trajectory()


def test_a_retraction_without_steps_is_refused() -> None:
    with pytest.raises(TrajectoryError, match="0 steps out"):
        replace(PULL, steps=0)
