"""Sensors that are zeroed late, and streams whose clocks have nothing in common: one line, and no wrong force."""

from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from import_cases import SMALL_BODY, completed

from estimator.errors import InputError
from estimator.experiment import Experiment, read_experiment
from estimator.importing import import_experiment

ANSWERS = {
    **SMALL_BODY,
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


STAMPS: dict[str, Callable[[datetime], str]] = {
    "ISO 8601": lambda moment: moment.isoformat(),
    "with a zone": lambda moment: moment.isoformat() + "+01:00",
    "with a space": lambda moment: moment.isoformat(sep=" "),
    "a clock": lambda moment: moment.strftime("%H:%M:%S.%f"),
    "decimal comma": lambda moment: moment.strftime("%H:%M:%S,%f"),
    "another date": lambda moment: moment.strftime("%d.%m.%Y %H:%M:%S.%f"),
}


@pytest.mark.parametrize("form", STAMPS)
@pytest.mark.parametrize("begin", ["2024-03-01T09:59:58.250000", "2024-03-01T23:59:57.750000"])
def test_stamps_of_a_clock_are_seconds(form: str, begin: str, tmp_path: Path) -> None:
    if form == "another date" and "23:59" in begin:
        begin = "2024-03-01T11:59:57.750000"
    start = datetime.fromisoformat(begin)
    stamps = [STAMPS[form](start + timedelta(seconds=float(now))) for now in TIME]
    lines = ["timestamp;px (mm);Fx (N)"]
    lines += [f"{stamp};{x:.6f};{0.3 * x:.6f}" for stamp, x in zip(stamps, WAY, strict=True)]
    (tmp_path / "pull.csv").write_text("\n".join(lines), encoding="utf-8")
    assert 'time = { column = "timestamp", unit = "s" }' in (
        import_experiment(tmp_path / "pull.csv", tmp_path / "first").mapping.read_text(encoding="utf-8")
    )
    found = imported(tmp_path / "pull.csv", tmp_path / "pull")
    assert found.time == pytest.approx(TIME, abs=1e-6)


@pytest.mark.parametrize("cell", ["stretch", "1-2-3", "10:61:00", "2024-13-01T00:00:00"])
def test_words_are_no_stamps(cell: str, tmp_path: Path) -> None:
    rows = "".join(f"{cell},{x:.3f},{0.3 * x:.3f}\n" for x in WAY)
    (tmp_path / "pull.csv").write_text("timestamp,px (mm),Fx (N)\n" + rows, encoding="utf-8")
    opened = [key for _, key in import_experiment(tmp_path / "pull.csv", tmp_path / "pull").open_lines]
    assert "[[clock]] rate_hz" in opened
