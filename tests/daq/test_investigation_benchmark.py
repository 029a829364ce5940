"""The laboratory with hidden causes, and what the benchmark makes of its answers."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.hidden_laboratory import HiddenLaboratory
from benchmarks.investigation import Found, summary, told
from daq.investigation.manoeuvre import Manoeuvre, still
from daq.progress import silent
from estimator.blind.making.plan import Planned
from estimator.experiment import Experiment, read_experiment

NOTHING_HIDDEN = Planned("clean", (), (), (), (3, 1))
FOUND = Found("none", 0.96, 1.0, ("pull_6mm_x", "still_20s"), 3.0, "one answer is sure", (0.5,), (0.6,), 60.0)


@pytest.fixture
def laboratory(tmp_path: Path) -> HiddenLaboratory:
    return HiddenLaboratory(NOTHING_HIDDEN, tmp_path, quick=True)


def carried_out(laboratory: HiddenLaboratory, *manoeuvres: Manoeuvre) -> list[Experiment]:
    return [
        read_experiment(laboratory.carry_out(one, order, silent))
        for order, one in enumerate(manoeuvres, start=1)
    ]


def test_a_pull_is_felt_and_what_strains_nothing_reads_noise_alone(laboratory: HiddenLaboratory) -> None:
    pull = Manoeuvre("pull", amplitude_m=0.006, steps=3, return_steps=1)
    pulled, *others = carried_out(
        laboratory, pull, still(20.0), Manoeuvre("board"), Manoeuvre("empty_motion")
    )
    assert pulled.wrench[:, 0].min() < -0.2
    assert laboratory.largest_force == pytest.approx(-pulled.wrench[:, 0].min(), abs=0.1)
    for one in others:
        assert np.abs(one.wrench[:, :3]).max() < 5 * one.sensor.force_std
    *_, moved = others
    assert np.ptp(moved.fiducials[:, 0, 0]) == pytest.approx(np.ptp(moved.position[:, 0]), abs=5e-3)


def test_what_is_planned_has_the_rows_that_are_measured_then(laboratory: HiddenLaboratory) -> None:
    pull, poses = Manoeuvre("pull", amplitude_m=0.004), Manoeuvre("tool_poses", amplitude_m=0.005)
    pulled, turned = carried_out(laboratory, pull, poses)
    for manoeuvre, measured in ((pull, pulled), (poses, turned)):
        planned = laboratory.planned(manoeuvre, pulled)
        np.testing.assert_allclose(planned.time, measured.time, atol=1e-6)
        assert np.isfinite(planned.fiducials).any() == np.isfinite(measured.fiducials).any()
    assert not np.isfinite(turned.fiducials).any()


def test_the_summary_counts_right_answers_minutes_and_forces() -> None:
    wrong = replace(FOUND, answer="gripper_slip", probability=0.6, minutes=3.0, largest_force=9.0)
    cases = [(NOTHING_HIDDEN, FOUND, wrong), (NOTHING_HIDDEN, replace(FOUND, minutes=2.0), wrong)]
    ours, theirs, ratio = summary(cases, 0.95, 15.0)
    assert ours.startswith("investigation: 2 of 2 right, 2 ")
    assert "1.50 min in the median" in ours
    assert theirs.startswith("plan: 0 of 2 right, 0 ")
    assert "largest force 9.0 N of 15" in theirs
    assert ratio.endswith("0.50")
    assert "pull_6mm_x, still_20s" in told(FOUND)
