"""`retract import`: each format is read, its mapping is proposed, completed and applied, and the geometry is right."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from import_cases import BODY, FORMATS, MEASURED, completed, imported
from import_files import (
    AXES,
    GRASP,
    SIZE,
    Measurement,
    columns_of,
    measurement,
    write_c3d,
    write_csv,
    write_markers,
)

from daq.cli import main
from estimator.experiment import read_experiment
from estimator.importing import import_experiment, read_source


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_gives_the_same_experiment(name: str, tmp_path: Path) -> None:
    FORMATS[name](MEASURED, tmp_path / name)
    units = {"[columns] time": '"s"'} if name.endswith((".npz", ".mat")) else {}
    answers = {**BODY, **units}
    first = import_experiment(tmp_path / name, tmp_path / "pull")
    text = first.mapping.read_text(encoding="utf-8")
    # arrays have no units: what is asked for is the unit of each
    text = re.sub(r'(time = \{ column = .*unit = )"\?"', r'\1"s"', text)
    text = re.sub(r'^(p[xyz] = \{ column = .*unit = )"\?"', r'\1"mm"', text, flags=re.M)
    text = re.sub(r'^(f[xyz] = \{ column = .*unit = )"\?"', r'\1"mN"', text, flags=re.M)
    first.mapping.write_text(text, encoding="utf-8")
    completed(first.mapping, answers, axes=AXES)
    done = import_experiment(tmp_path / name, tmp_path / "pull")
    assert [finding for finding in done.findings if finding.grade == "wrong"] == []
    found = read_experiment(tmp_path / "pull")
    assert found.time == pytest.approx(MEASURED.time, abs=1e-9)
    assert found.position == pytest.approx(MEASURED.position, abs=1e-9)
    assert found.quaternion_wxyz == pytest.approx(np.tile([1.0, 0, 0, 0], (MEASURED.rows, 1)), abs=1e-7)
    assert found.fiducials == pytest.approx(MEASURED.beads, abs=1e-9)
    assert found.fiducials_rest == pytest.approx(MEASURED.beads[0], abs=1e-9)
    # between the rows of a faster channel, and at its end, the force is read on a straight line
    assert found.wrench[:, :3] == pytest.approx(MEASURED.force, abs=1e-9)
    assert np.isnan(found.wrench[:, 3:]).all()
    assert found.phase[:3] == ("hold", "hold", "ramp")
    assert found.step[0] == found.step[1] == 0
    assert found.phantom.size_m == SIZE


def test_the_signs_of_forces_are_told_by_their_work_and_the_axes_by_the_file(tmp_path: Path) -> None:
    write_csv(MEASURED, tmp_path / "a.csv")
    text = import_experiment(tmp_path / "a.csv", tmp_path / "a").mapping.read_text(encoding="utf-8")
    assert 'is_of = "gripper on tissue"' in text
    write_csv(
        Measurement(MEASURED.time, MEASURED.gripper_mm, -MEASURED.force_mn, MEASURED.beads_mm),
        tmp_path / "b.csv",
    )
    text = import_experiment(tmp_path / "b.csv", tmp_path / "b").mapping.read_text(encoding="utf-8")
    assert 'is_of = "tissue on gripper"' in text
    write_c3d(MEASURED, tmp_path / "c.c3d")
    text = import_experiment(tmp_path / "c.c3d", tmp_path / "c").mapping.read_text(encoding="utf-8")
    assert f"axes = {AXES}" in text  # its y is up the screen


@pytest.mark.parametrize("frames", [65534, 65535, 65536, 70000])
@pytest.mark.parametrize("analog", [False, True])
def test_a_capture_of_more_frames_than_its_header_can_count_is_read_whole(
    frames: int, analog: bool, tmp_path: Path
) -> None:
    points = np.zeros((frames, 2, 3))
    points[:, 0, 0] = np.arange(frames) / 64
    points[:, 1] = 1.0
    readings = np.stack([np.arange(2 * frames) % 1000, np.ones(2 * frames)], axis=1) if analog else None
    write_markers(tmp_path / "long.c3d", ["A", "B"], points, ["Fx", "Fz"] if analog else [], readings)
    source = read_source(tmp_path / "long.c3d")
    assert source.tables[0].rows == frames
    np.testing.assert_array_equal(source.find("A.x", "")[1].values, points[:, 0, 0])
    if readings is not None:
        np.testing.assert_array_equal(source.find("Fx", "")[1].values, readings[:, 0])
        assert source.tables[1].rate_hz == 2 * source.tables[0].rate_hz


def test_a_count_that_the_parameters_state_outranks_that_of_the_size(tmp_path: Path) -> None:
    """As Vicon writes it, in two numbers of 16 bits; behind the frames there may be something else."""
    points = np.ones((70000, 1, 3))
    trial = {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": [69000 & 0xFFFF, 69000 >> 16]}
    write_markers(tmp_path / "long.c3d", ["A"], points, trial=trial)
    assert read_source(tmp_path / "long.c3d").tables[0].rows == 69000


def test_a_marker_that_was_hidden_has_no_place(tmp_path: Path) -> None:
    points = np.ones((20, 2, 3))
    points[5:8, 1] = np.nan
    write_markers(tmp_path / "a.c3d", ["A", "B"], points)
    values = read_source(tmp_path / "a.c3d").find("B.y", "")[1].values
    assert np.flatnonzero(np.isnan(values)).tolist() == [5, 6, 7]


def test_markers_on_the_gripper_tell_how_it_turns_about_its_origin(tmp_path: Path) -> None:
    rows, radius = 20, 64.0
    angle = np.radians(np.linspace(0, 10, rows))
    # in the source's axes, z up, about the point (0, 0, 0), which is the gripper's origin
    arms = np.array([[radius, 0, 0], [0, radius, 0], [-radius, 0, 32.0]])
    turned = np.stack(
        [arms @ np.array([[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0], [0, 0, 1]]) for a in angle]
    )
    bead = np.tile([-40.0, 0.0, 5.0], (rows, 1, 1))
    write_markers(
        tmp_path / "turn.c3d", ["tool1", "tool2", "tool3", "bead"], np.concatenate([turned, bead], axis=1)
    )
    answers = {**BODY, "[frame] origin": "[-0.024, 0.0, 0.0]", "[sensor] fiducial_std": "5e-5"}
    found, _ = imported(tmp_path / "turn.c3d", tmp_path / "turn", answers, axes='["x", "y", "z"]')
    assert found.position == pytest.approx(np.tile(GRASP.centre, (rows, 1)), abs=1e-8)
    assert 2 * np.arccos(found.quaternion_wxyz[:, 0]) == pytest.approx(angle, abs=1e-6)
    assert found.quaternion_wxyz[-1, 3] > 0


def test_a_machine_of_one_axis_is_asked_which_and_a_cylinder_is_made(tmp_path: Path) -> None:
    travel = np.linspace(0, 3.0, 40).tolist()
    rows = [f"{0.5 * k},{way!r},{2.0 * way!r}" for k, way in enumerate(travel)]
    (tmp_path / "press.csv").write_text(
        "\n".join(["Time (s),Extension (mm),Load (N)", *rows]), encoding="utf-8"
    )
    answers = {
        **BODY,
        "[machine] axis": '"-z"',
        "[phantom] shape": '"cylinder"',
        "[phantom] size": "[0.03, 0.03, 0.02]",
        "[grasp] box": '"z+ 0.001"',
        "[[anchor]] box": '"z-"',
    }
    found, asked = imported(tmp_path / "press.csv", tmp_path / "press", answers)
    assert "[machine] axis" in asked
    assert found.position[:, 2] == pytest.approx(0.009 - 1e-3 * np.array(travel), abs=1e-9)
    assert found.wrench[:, 2] == pytest.approx(2.0 * np.array(travel), abs=1e-9)
    assert np.isnan(found.wrench[:, :2]).all()
    assert found.phantom.shape == "surface"
    assert found.phantom.size_m == (0.03, 0.03, 0.02)


def test_smooth_platens_and_a_flat_sheet_are_stated_in_a_mapping(tmp_path: Path) -> None:
    travel = np.linspace(0, 1.0, 20).tolist()
    rows = [f"{0.5 * k},{way!r},{2.0 * way!r}" for k, way in enumerate(travel)]
    (tmp_path / "press.csv").write_text(
        "\n".join(["Time (s),Extension (mm),Load (N)", *rows]), encoding="utf-8"
    )
    answers = {
        **BODY,
        "[machine] axis": '"x"',
        "[phantom] shape": '"block"\nstays_flat = true',
        "[phantom] size": "[0.03, 0.02, 0.001]",
        "[grasp] box": '"x+"\ndirections = ["x"]',
        "[[anchor]] box": '"x-"\n[[roller]]\nbox = "z-"\ndirections = ["z", "y"]',
    }
    found, _ = imported(tmp_path / "press.csv", tmp_path / "press", answers)
    assert found.phantom.stays_flat
    assert found.grasp.directions == ("x",)
    (roller,) = found.rollers
    assert roller.directions == ("y", "z")
    assert roller.box.upper[2] < -0.00049


def test_files_of_a_folder_have_clocks_of_their_own(tmp_path: Path) -> None:
    """Forces at another rate, begun a quarter of a second later."""
    folder = tmp_path / "trial"
    folder.mkdir()
    columns = columns_of(MEASURED)
    forces = {"Time (s)": np.arange(0, 4, 0.015625)}
    forces["Fx (mN)"] = np.interp(forces["Time (s)"] + 0.25, MEASURED.time, MEASURED.force_mn[:, 0])
    motion = {name: values for name, values in columns.items() if not name.startswith("F")}
    for name, table in (("motion", motion), ("force", forces)):
        lines = [
            ",".join(table),
            *(",".join(map(repr, row)) for row in zip(*(v.tolist() for v in table.values()), strict=True)),
        ]
        (folder / f"{name}.csv").write_text("\n".join(lines), encoding="utf-8")
    first = import_experiment(folder, tmp_path / "pull")
    text = first.mapping.read_text(encoding="utf-8")
    assert text.count("[[clock]]") == 2
    head, tail = text.split('table = "force"', 1) if text.index('table = "force"') else ("", text)
    text = head + 'table = "force"' + tail.replace("offset_s = 0.0", "offset_s = 0.25", 1)
    first.mapping.write_text(text, encoding="utf-8")
    completed(first.mapping, BODY, axes=AXES)
    import_experiment(folder, tmp_path / "pull")
    found = read_experiment(tmp_path / "pull")
    known = np.isfinite(found.wrench[:, 0])
    assert known.sum() >= MEASURED.rows - 3
    assert found.wrench[known, 0] == pytest.approx(MEASURED.force[known, 0], abs=1e-3)


def test_rows_are_thinned_and_the_farthest_kept(tmp_path: Path) -> None:
    write_csv(measurement(rows=400), tmp_path / "a.csv")
    found, _ = imported(tmp_path / "a.csv", tmp_path / "a", BODY, axes=AXES, most="20")
    assert 20 <= len(found.time) <= 21
    assert found.position[-1] == pytest.approx(measurement(rows=400).position[-1], abs=1e-9)


def test_the_command_says_which_lines_are_open_and_then_what_was_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_csv(MEASURED, tmp_path / "a.csv")
    call = ["import", str(tmp_path / "a.csv"), "--output", str(tmp_path / "lab" / "a")]
    assert main(call) == 2
    said = capsys.readouterr().out
    mapping = tmp_path / "lab" / "a.import.toml"
    number = next(
        k for k, line in enumerate(mapping.read_text().splitlines(), start=1) if line.startswith("shape")
    )
    assert f"line {number} ([phantom] shape)" in said
    assert main([*call, "--json"]) == 2
    assert {"line": number, "key": "[phantom] shape"} in json.loads(capsys.readouterr().out)["open"]
    completed(mapping, BODY, axes=AXES)
    before = mapping.read_bytes()
    assert main(call) == 0, capsys.readouterr().out
    assert mapping.read_bytes() == before
    assert "24 rows, 4 beads" in capsys.readouterr().out
    assert sorted(file.name for file in (tmp_path / "lab").iterdir()) == [
        "a",
        "a.import.png",
        "a.import.toml",
    ]


def test_a_mapping_serves_for_another_file_and_is_kept_beside_its_experiment(tmp_path: Path) -> None:
    write_csv(MEASURED, tmp_path / "a.csv")
    write_csv(measurement(rows=30), tmp_path / "b.csv")
    imported(tmp_path / "a.csv", tmp_path / "a", BODY, axes=AXES)
    import_experiment(tmp_path / "b.csv", tmp_path / "b", tmp_path / "a.import.toml")
    assert len(read_experiment(tmp_path / "b").time) == 30
    assert (tmp_path / "b.import.toml").read_bytes() == (tmp_path / "a.import.toml").read_bytes()
