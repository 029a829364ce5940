"""Sensors that are zeroed late, and streams whose clocks have nothing in common: one line, and no wrong force."""

from pathlib import Path

import numpy as np
import pytest
from import_cases import completed

from estimator.errors import InputError
from estimator.experiment import Experiment, read_experiment
from estimator.importing import import_experiment

ANSWERS = {
    "[phantom] shape": '"block"',
    "[phantom] size": "[0.06, 0.03, 0.01]",
    "[grasp] box": '"x+ 0.012"',
    "[[anchor]] box": '"x-"',
    "[environment] surface_below": '"none"',
    "[sensor] force_std": "0.01",
    "[sensor] torque_std": "0.001",
    "[sensor] fiducial_std": "5e-5",
    "[force] is_of": '"gripper on tissue"',
}
TIME = np.arange(0.0, 10.0, 0.1)
WAY = np.clip(TIME - 2.0, 0.0, None)
NOISE = 5e-3 * np.random.default_rng(7).standard_normal(len(TIME))


def written(file: Path, **columns: np.ndarray) -> None:
    lines = [
        ",".join(columns),
        *(",".join(f"{v:.6f}" for v in row) for row in zip(*columns.values(), strict=True)),
    ]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def imported(source: Path, output: Path, **instead: str) -> Experiment:
    completed(import_experiment(source, output).mapping, ANSWERS, most="200", **instead)
    import_experiment(source, output)
    return read_experiment(output)


@pytest.mark.parametrize("offset", [5.0, -0.6])
@pytest.mark.parametrize("row", [3, 10, 18])
def test_a_sensor_that_is_zeroed_at_rest_is_told_with_the_row_to_begin_at(
    row: int, offset: float, tmp_path: Path
) -> None:
    force = 0.3 * WAY + NOISE + np.where(np.arange(len(TIME)) < row, offset, 0.0)
    written(tmp_path / "pull.csv", **{"Time (s)": TIME, "px (mm)": WAY, "Fx (N)": force})
    with pytest.raises(InputError, match=rf"the force jumps at rest, in row {row + 1}, .*first = {row + 1},"):
        imported(tmp_path / "pull.csv", tmp_path / "pull")
    found = imported(tmp_path / "pull.csv", tmp_path / "again", first=f"{row + 1}")
    assert found.wrench[-1, 0] == pytest.approx(-0.3 * WAY[-1], abs=0.02)


@pytest.mark.parametrize("noise", [0.0, 1.0, 20.0])
def test_noise_at_rest_is_no_jump(noise: float, tmp_path: Path) -> None:
    written(
        tmp_path / "pull.csv", **{"Time (s)": TIME, "px (mm)": WAY, "Fx (N)": 0.3 * WAY + 1.0 + noise * NOISE}
    )
    found = imported(tmp_path / "pull.csv", tmp_path / "pull")
    assert found.wrench[-1, 0] == pytest.approx(-0.3 * WAY[-1], abs=0.02 + 0.02 * noise)


def test_streams_without_a_moment_in_common_are_told(tmp_path: Path) -> None:
    source = tmp_path / "trial"
    source.mkdir()
    written(source / "motion.csv", **{"Time (s)": TIME, "px (mm)": WAY})
    written(source / "force.csv", **{"Time (s)": TIME + 1.7e9, "Fx (N)": 0.3 * WAY})
    with pytest.raises(InputError, match=r"no moment in common; state offset_s of their \[\[clock\]\]"):
        imported(source, tmp_path / "pull")


@pytest.mark.parametrize(("unit", "per_Nm"), [("N-m", 1.0), ("Nmm", 1e3), ("lbf-in", 8.850745767)])
def test_torques_are_understood_in_every_unit(unit: str, per_Nm: float, tmp_path: Path) -> None:
    torque = {f"Tz ({unit})": 0.01 * WAY * per_Nm}
    written(tmp_path / "pull.csv", **{"Time (s)": TIME, "px (mm)": WAY, "Fx (N)": 0.3 * WAY, **torque})
    found = imported(tmp_path / "pull.csv", tmp_path / "pull")
    assert found.wrench[-1, 5] == pytest.approx(-0.01 * WAY[-1], rel=1e-4)
