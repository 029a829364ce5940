"""What sensors read while no tissue is strained, and which causes show in it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from synthetic_diagnoses import small_experiment

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.effects.catalogue import default_catalogue
from estimator.effects.effect import Effect
from estimator.experiment import Experiment
from estimator.inference.channels import measured_rows
from estimator.optimal_design.unstrained import (
    unstrained_channels,
    unstrained_signature,
    unstrained_whitening,
)

FloatArray = NDArray[np.float64]

BASELINE = Hypothesis(15e3, 0.45)


def motionless() -> Experiment:
    """Half a minute at rest."""
    like, rows = small_experiment(), 8
    return replace(
        like,
        time=4.0 * np.arange(rows),
        phase=("hold",) * rows,
        step=np.zeros(rows, dtype=np.int64),
        position=np.tile(like.grasp.centre, (rows, 1)),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1)),
        wrench=np.zeros((rows, 6)),
        fiducials=np.tile(like.fiducials_rest, (rows, 1, 1)),
    )


def turning() -> Experiment:
    """The empty gripper turned about y, further and further; what it carries is seen."""
    still = motionless()
    turn = Rotation.from_rotvec(np.outer(np.linspace(0.0, 0.4, 8), [0.0, 1.0, 0.0]))
    way = np.outer(np.linspace(0.0, 0.008, 8), [1.0, 0.0, 0.0])
    return replace(still, position=still.position + way, quaternion_wxyz=turn.as_quat(scalar_first=True))


def effect_named(name: str) -> Effect:
    """The effect of this name, or the first form of this label."""
    return next(one for one in default_catalogue().effects if name in (one.name, one.label))


def stands_out(experiment: Experiment, name: str) -> float:
    """By how many deviations the usual size of an effect shows."""
    effect = effect_named(name)
    start = {one.name: one.grid[0] if one.grid else one.lower for one in effect.constants}
    columns = unstrained_signature(experiment, BASELINE, effect, start)
    return float(np.linalg.norm(columns @ [amplitude.scale for amplitude in effect.amplitudes]))


@pytest.mark.parametrize(
    ("name", "at_rest", "in_the_air"),
    [
        ("tool_weight", False, True),
        ("motion_scale", False, True),
        ("motion_direction", False, True),
        ("camera_scale", True, True),
        ("camera_rotation", True, True),
        ("strain_stiffening", False, False),
        ("gripper_slip", False, False),
        ("inhomogeneity", False, False),
        ("grasp_misplacement:gripper", False, False),
        ("prestretch", False, False),
        ("fiducial_mislabel", False, False),
    ],
)
def test_each_device_shows_where_nothing_is_strained_and_the_tissue_never(
    name: str, at_rest: bool, in_the_air: bool
) -> None:
    assert (stands_out(motionless(), name) > 3.0) is at_rest
    assert (stands_out(turning(), name) > 3.0) is in_the_air


def test_a_sensor_that_drifts_shows_while_all_stands_still() -> None:
    drifts = [one.name for one in default_catalogue().effects if one.label == "force_drift"]
    assert max(stands_out(motionless(), name) for name in drifts) > 3.0


def test_a_zero_that_is_off_by_one_reading_shows_no_more_than_that() -> None:
    still = motionless()
    offset = np.tile([0.02, 0.0, 0.0, 0.0, 0.0, 0.0], (8, 1))
    seen = replace(still, wrench=still.wrench + offset)
    whitening = unstrained_whitening(still)
    left = whitening.residual(measured_rows(seen), unstrained_channels(still, BASELINE))
    assert 0.5 < np.linalg.norm(left) < 1.0
