"""Exports of motion capture, whose names stand in several rows: which marker a column is of."""

from pathlib import Path

import numpy as np
import pytest
from import_cases import SMALL_BODY, completed

from estimator.experiment import read_experiment
from estimator.importing import import_experiment, read_source

TIME = np.arange(0.0, 8.0, 0.1)
WAY = 3.0 * np.clip(TIME - 1.0, 0.0, None) / 7
MARKERS = {
    name: np.outer(WAY, [0.2 * k, 0.01, 0.02]) + np.array([10.0 * k - 20, 3, 5])
    for k, name in enumerate("ABC")
}
TOOL = np.outer(WAY, [1.0, 0.0, 0.0]) + np.array([24.0, 0.0, 0.0])


def rows(*columns: np.ndarray, separator: str = ",") -> str:
    table = np.column_stack(columns)
    return "".join(separator.join([f"{row[0]:.0f}", *(f"{v:.6f}" for v in row[1:])]) + "\n" for row in table)


def of_groups(separator: str) -> str:
    """Names of markers above the first of their three columns."""
    names = [f"Subject:{name}" for name in (*MARKERS, "tool")]
    head = ["Trajectories", "100", separator.join(["", "", *(f"{name}{2 * separator}" for name in names)])]
    head.append(separator.join(["Frame", "Sub Frame", *"XYZ" * 4]))
    head.append(separator.join(["", "", *["mm"] * 12]))
    numbers = rows(np.arange(len(TIME)), 0 * TIME, *MARKERS.values(), TOOL, separator=separator)
    return "\n".join(head) + "\n" + numbers


def of_rigid_bodies() -> str:
    """Names of markers above every column, and a rigid body with its turn and place."""
    head = [
        "Format Version,1.23,Rotation Type,Quaternion,Length Units,Millimeters",
        "",
        ",Type," + ",".join(["Marker"] * 9 + ["Rigid Body"] * 7),
        ",Name," + ",".join([*np.repeat([f"Unlabeled {name}" for name in MARKERS], 3), *["tool"] * 7]),
        ",ID," + ",".join(["A1:7F"] * 9 + ["B2"] * 7),
        ",," + ",".join(["Position"] * 9 + ["Rotation"] * 4 + ["Position"] * 3),
        "Frame,Time (s)," + ",".join([*"XYZ" * 3, *"XYZWXYZ"]),
    ]
    unturned = np.tile([0.0, 0.0, 0.0, 1.0], (len(TIME), 1))
    return "\n".join(head) + "\n" + rows(np.arange(len(TIME)), TIME, *MARKERS.values(), unturned, TOOL)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_columns_are_named_by_the_marker_above_them(separator: str, tmp_path: Path) -> None:
    file = tmp_path / "capture.csv"
    file.write_text(of_groups(separator), encoding="utf-8")
    (table,) = read_source(file).tables
    names = [f"Subject:{name}.{axis}" for name in (*MARKERS, "tool") for axis in "XYZ"]
    assert [column.name for column in table.columns] == ["Frame", "Sub Frame", *names]
    assert {column.unit for column in table.columns[2:]} == {"mm"}
    assert table.columns[9].values == pytest.approx(MARKERS["C"][:, 1])


def test_every_marker_of_a_capture_becomes_a_bead_and_the_tool_the_gripper(tmp_path: Path) -> None:
    file = tmp_path / "capture.csv"
    file.write_text(of_rigid_bodies(), encoding="utf-8")
    mapping = import_experiment(file, tmp_path / "pull").mapping
    text = mapping.read_text(encoding="utf-8")
    assert 'qw = { column = "tool.Rotation.W" }' in text
    completed(
        mapping,
        {
            **dict.fromkeys(("[columns] px", "[columns] py", "[columns] pz", "[beads] unit"), '"mm"'),
            "[frame] origin": "[0.0, 0.0, 0.0]",
            **SMALL_BODY,
        },
    )
    assert import_experiment(file, tmp_path / "pull").refusal == ""
    found = read_experiment(tmp_path / "pull")
    assert found.position[-1, 0] - found.position[0, 0] == pytest.approx(1e-3 * WAY[-1])
    for bead, places in enumerate(MARKERS.values()):
        assert found.fiducials[-1, bead] == pytest.approx(1e-3 * places[-1])
