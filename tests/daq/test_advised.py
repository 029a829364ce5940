"""What a diagnosis advises, as the laboratory carries it out."""

from pathlib import Path

import numpy as np
import pytest

from daq.frames import rotation
from daq.plans.advised import advised_trial
from estimator.diagnosis.conclusions.design_of_experiments import MANOEUVRES
from estimator.diagnosis.result import Manoeuvre


@pytest.mark.parametrize("manoeuvre", MANOEUVRES, ids=lambda one: one.words.split(",")[0])
def test_a_manoeuvre_goes_as_far_as_it_says_holds_and_returns(manoeuvre: Manoeuvre, tmp_path: Path) -> None:
    trial = advised_trial(manoeuvre, tmp_path / "manoeuvres")
    rest, *steps = trial.lay_out(tmp_path).steps
    hold = max(steps, key=lambda step: step.settle_s)
    assert hold.settle_s == 30.0
    assert hold.T_rest_gripper.position == pytest.approx(manoeuvre.offset_m)
    turn = rotation(hold.T_rest_gripper.quaternion_wxyz).as_rotvec()
    assert turn == pytest.approx(manoeuvre.turn_rad, abs=1e-6)
    assert steps[-1].T_rest_gripper.position == pytest.approx(rest.T_rest_gripper.position)
    ways = np.diff([step.T_rest_gripper.position for step in steps], axis=0)
    assert np.linalg.norm(ways, axis=1).max() < 0.005
