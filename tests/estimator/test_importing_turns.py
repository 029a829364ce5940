"""The gripper's orientation as files write it: at another rate than the rest, with changes of sign, with gaps."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from import_cases import SMALL_BODY, completed
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.experiment import Experiment, read_experiment
from estimator.importing import import_experiment

ANSWERS = {
    **SMALL_BODY,
    "[environment] surface_below": '"table"',
    "[force] is_of": '"gripper on tissue"',
    "[frame] origin": "[0.0, 0.0, 0.0]",
    "[force] along": '"source"',
}
Form = Callable[[bool], dict[str, np.ndarray]]
TIME = np.arange(0.0, 8.0, 0.1)
ANGLE = 0.03 * np.clip(TIME - 1.0, 0.0, None)
DOWN = Rotation.from_rotvec([np.pi, 0.0, 0.0])  # a tool that points down
TURNS = Rotation.from_rotvec(np.outer(ANGLE, [0.0, 1.0, 0.0])) * DOWN


def written(file: Path, columns: dict[str, np.ndarray]) -> None:
    lines = [",".join(columns)]
    lines += [
        ",".join("" if np.isnan(value) else f"{value:.9f}" for value in row)
        for row in zip(*columns.values(), strict=True)
    ]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def quaternions(flipped: bool) -> dict[str, np.ndarray]:
    values = TURNS.as_quat(scalar_first=True)
    if flipped:
        values = values * np.where(np.arange(len(values)) // 3 % 2, -1.0, 1.0)[:, None]
    return dict(zip(("qw", "qx", "qy", "qz"), values.T, strict=True))


def rotation_vectors(flipped: bool) -> dict[str, np.ndarray]:
    values = TURNS.as_rotvec()
    if flipped:
        length = np.linalg.norm(values, axis=1, keepdims=True)
        values = np.where(np.arange(len(values))[:, None] % 2, values * (1 - 2 * np.pi / length), values)
    return dict(zip(("rx (rad)", "ry (rad)", "rz (rad)"), values.T, strict=True))


def experiment(folder: Path, orientation: dict[str, np.ndarray]) -> Experiment:
    """Import a pose at 10 Hz beside a bead at 3.7 Hz."""
    source = folder / "trial"
    source.mkdir()
    way = 100 * ANGLE
    motion = {
        "Time (s)": TIME,
        "px (mm)": 300 + way,
        "py (mm)": 0 * way,
        "pz (mm)": 0 * way,
        "Fx (N)": 0.3 * way,
    }
    written(source / "pose.csv", {**motion, **orientation})
    seen = np.arange(0.0, 7.5, 1 / 3.7)
    bead = {"Time (s)": seen, "b0_x (mm)": 0 * seen, "b0_y (mm)": 0 * seen, "b0_z (mm)": 0 * seen + 2}
    written(source / "beads.csv", bead)
    completed(import_experiment(source, folder / "pull").mapping, ANSWERS)
    import_experiment(source, folder / "pull")
    return read_experiment(folder / "pull")


@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("form", [quaternions, rotation_vectors])
def test_an_orientation_between_two_rows_is_between_their_orientations(
    form: Form, flipped: bool, tmp_path: Path
) -> None:
    found = experiment(tmp_path, form(flipped))
    turned = Rotation.from_quat(found.quaternion_wxyz, scalar_first=True).as_rotvec()
    assert turned[:, 1] == pytest.approx(0.03 * np.clip(found.time - 1.0, 0.0, None), abs=5e-4)
    assert turned[:, [0, 2]] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("form", [quaternions, rotation_vectors])
def test_a_row_without_orientation_has_no_pose(form: Form, tmp_path: Path) -> None:
    """It is not taken for one that is not turned."""
    columns = form(False)
    for values in columns.values():
        values[40] = np.nan
    way = 100 * ANGLE
    motion = {"Time (s)": TIME, "px (mm)": way, "py (mm)": 0 * way, "pz (mm)": 0 * way, "Fx (N)": 0.3 * way}
    written(tmp_path / "pose.csv", {**motion, **columns})
    mapping = import_experiment(tmp_path / "pose.csv", tmp_path / "pull").mapping
    completed(mapping, ANSWERS, most="200")
    import_experiment(tmp_path / "pose.csv", tmp_path / "pull")
    found = read_experiment(tmp_path / "pull")
    assert len(found.time) == len(TIME) - 1
    turned = Rotation.from_quat(found.quaternion_wxyz, scalar_first=True).magnitude()
    assert turned == pytest.approx(np.delete(ANGLE, 40), abs=1e-6)


def test_a_first_row_without_orientation_is_refused(tmp_path: Path) -> None:
    columns = quaternions(False)
    columns["qx"][0] = np.nan
    way = 100 * ANGLE
    written(tmp_path / "pose.csv", {"Time (s)": TIME, "px (mm)": way, "Fx (N)": 0.3 * way, **columns})
    completed(import_experiment(tmp_path / "pose.csv", tmp_path / "pull").mapping, ANSWERS)
    with pytest.raises(
        InputError, match=r"\[rows\] first: place or orientation .* is not known in the first row"
    ):
        import_experiment(tmp_path / "pose.csv", tmp_path / "pull")


def of_names(form: str) -> dict[str, np.ndarray]:
    scalar_first = TURNS.as_quat(scalar_first=True)
    values, names = {
        "numbered": (scalar_first, ("q0", "q1", "q2", "q3")),
        "of a topic": (scalar_first, tuple(f"/pose/pose/orientation/{axis}" for axis in "wxyz")),
        "of a message": (scalar_first, tuple(f"field.pose.orientation.{axis}" for axis in "wxyz")),
        "roll, pitch, yaw": (TURNS.as_euler("xyz", degrees=True), ("roll (deg)", "pitch (deg)", "yaw (deg)")),
        "xyz": (TURNS.as_euler("xyz", degrees=True), ("rx (deg)", "ry (deg)", "rz (deg)")),
        "ZYX": (TURNS.as_euler("ZYX", degrees=True)[:, ::-1], ("rx (deg)", "ry (deg)", "rz (deg)")),
        "ZYX of an arm": (TURNS.as_euler("ZYX", degrees=True), ("A (deg)", "B (deg)", "C (deg)")),
        "rotation vector": (TURNS.as_rotvec(), ("rx (rad)", "ry (rad)", "rz (rad)")),
    }[form]
    return dict(zip(names, values.T, strict=True))


def motion() -> dict[str, np.ndarray]:
    way = 100 * ANGLE
    return {"Time (s)": TIME, "px (mm)": way, "Fx (N)": 0.3 * way}


@pytest.mark.parametrize(
    "form",
    [
        "numbered",
        "of a topic",
        "of a message",
        "roll, pitch, yaw",
        "xyz",
        "ZYX",
        "ZYX of an arm",
        "rotation vector",
    ],
)
def test_an_orientation_is_understood_or_asked_for(form: str, tmp_path: Path) -> None:
    written(tmp_path / "pose.csv", {**motion(), **of_names(form)})
    mapping = import_experiment(tmp_path / "pose.csv", tmp_path / "pull").mapping
    asked = completed(mapping, {**ANSWERS, "[turn] angles": f'"{form[:3]}"'})
    assert ("[turn] angles" in asked) == (form in ("xyz", "ZYX", "ZYX of an arm"))
    import_experiment(tmp_path / "pose.csv", tmp_path / "pull")
    found = read_experiment(tmp_path / "pull")
    turned = Rotation.from_quat(found.quaternion_wxyz, scalar_first=True).as_rotvec()
    assert turned[:, 1] == pytest.approx(0.03 * np.clip(found.time - 1.0, 0.0, None), abs=1e-6)
    assert turned[:, [0, 2]] == pytest.approx(0.0, abs=1e-6)


def test_a_quaternion_numbered_from_one_is_asked_for_and_joints_are_none(tmp_path: Path) -> None:
    values = dict(zip(("q1", "q2", "q3", "q4"), TURNS.as_quat(scalar_first=True).T, strict=True))
    written(tmp_path / "pose.csv", {**motion(), **values})
    opened = [key for _, key in import_experiment(tmp_path / "pose.csv", tmp_path / "pull").open_lines]
    assert opened[:4] == ["[columns] qw", "[columns] qx", "[columns] qy", "[columns] qz"]
    written(tmp_path / "joints.csv", {**motion(), **values, "q5": 0.2 * TIME, "q6": 0.1 * TIME})
    opened = [key for _, key in import_experiment(tmp_path / "joints.csv", tmp_path / "joints").open_lines]
    assert not any(key.startswith("[columns] q") for key in opened)
