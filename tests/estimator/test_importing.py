"""`retract import`: each format is read, its mapping is proposed, completed and applied, and the geometry is right."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from import_files import (
    AXES,
    GRASP,
    NCORR_MM,
    NCORR_SPACING,
    ORIGIN_MM,
    SIZE,
    Field,
    Measurement,
    columns_of,
    field,
    measurement,
    write_c3d,
    write_csv,
    write_frames,
    write_german_csv,
    write_hdf5,
    write_markers,
    write_mat5,
    write_mat73,
    write_mudic_npz,
    write_ncorr,
    write_ncorr73,
    write_npz,
    write_xlsx,
)

from daq.cli import main
from estimator.errors import InputError
from estimator.experiment import Experiment, read_experiment
from estimator.importing import import_experiment, read_source
from estimator.importing.formats import matlab

MEASURED = measurement()
FORMATS: dict[str, Callable[[Measurement, Path], None]] = {
    "trial.csv": write_csv,
    "german.csv": write_german_csv,
    "trial.xlsx": write_xlsx,
    "trial.npz": write_npz,
    "trial.h5": write_hdf5,
    "trial.mat": write_mat5,
    "trial73.mat": write_mat73,
    "trial.c3d": write_c3d,
}
SIZE_TEXT = json.dumps(list(SIZE))
BODY = {
    "[phantom] shape": '"block"',
    "[phantom] size": SIZE_TEXT,
    "[grasp] box": json.dumps([list(GRASP.box.lower), list(GRASP.box.upper)]),
    "[[anchor]] box": '"x-"',
    "[environment] surface_below": '"table"',
    "[sensor] force_std": "0.01",
    "[sensor] fiducial_std": "5e-5",
    "[frame] origin": json.dumps([1e-3 * value for value in ORIGIN_MM]),
    "[beads] unit": '"mm"',
    "[force] is_of": '"gripper on tissue"',
}


def completed(file: Path, answers: dict[str, str], **instead: str) -> list[str]:
    """Fill in the lines that are open by their keys, replace others by how they begin; return what was open."""
    heading, lines, asked = "", [], []
    for line in file.read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            heading = line.split("#")[0].strip()
        key = f"{heading} {line.partition('=')[0].strip()}"
        if '"?"' in line.split("#")[0]:
            asked.append(key)
            value = answers[key]
            line = line.replace('"?"', value, 1)  # noqa: PLW2901 - the line as it is written
        for begin, replacement in instead.items():
            if line.startswith(f"{begin} ="):
                line = f"{begin} = {replacement}"  # noqa: PLW2901
        lines.append(line)
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return asked


def imported(
    source: Path, folder: Path, answers: dict[str, str], **instead: str
) -> tuple[Experiment, list[str]]:
    """Import in the two steps of a user; return the experiment and what was asked."""
    first = import_experiment(source, folder)
    assert first.proposed
    assert first.open_lines
    asked = completed(first.mapping, answers, **instead)
    assert asked == [key for _, key in first.open_lines]
    second = import_experiment(source, folder)
    assert second.open_lines == ()
    assert second.refusal == ""
    assert second.picture is not None
    assert second.picture.stat().st_size > 0
    return read_experiment(folder), asked


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


FLAT, SOLID = field(2), field(3)
FIELDS: dict[str, tuple[Field, Callable[[Path], None]]] = {
    "dice": (FLAT, lambda place: write_frames(place, FLAT, "dice")),
    "vic3d": (SOLID, lambda place: write_frames(place, SOLID, "vic3d")),
    "matchid": (SOLID, lambda place: write_frames(place, SOLID, "matchid")),
    "gom": (SOLID, lambda place: write_frames(place, SOLID, "gom")),
    "mudic": (FLAT, lambda place: write_frames(place, FLAT, "mudic")),
    "mudic.npz": (FLAT, lambda place: write_mudic_npz(place, FLAT)),
}


@pytest.mark.parametrize("name", FIELDS)
def test_the_points_of_an_image_correlation_are_followed(name: str, tmp_path: Path) -> None:
    one, write = FIELDS[name]
    write(tmp_path / name)
    source = read_source(tmp_path / name)
    (table,) = source.tables
    expected = one.reference + one.displacement
    assert table.rows == len(one.displacement)
    for point in range(len(one.reference)):
        for k, axis in enumerate("xyz"[: one.reference.shape[1]]):
            found = source.find(f"p{point:04d}.{axis}", "")[1].values
            assert found == pytest.approx(expected[:, point, k], abs=1e-9)
    assert source.y_down == (one is FLAT)


@pytest.mark.parametrize("write", [write_ncorr, write_ncorr73])
def test_the_points_of_ncorr_are_followed_from_the_undeformed_image(
    write: Callable[[Path, Field], None], tmp_path: Path
) -> None:
    write(tmp_path / "analysis.mat", FLAT)
    source = read_source(tmp_path / "analysis.mat")
    rows, columns = np.indices((4, 5))
    reference = np.stack([columns.ravel(), rows.ravel()], axis=1) * (NCORR_SPACING + 1) * NCORR_MM
    expected = reference + FLAT.displacement
    for point in range(len(reference)):
        assert source.find(f"p{point:04d}.x", "")[1].values == pytest.approx(expected[:, point, 0], abs=1e-9)
        assert source.find(f"p{point:04d}.y", "")[1].values == pytest.approx(expected[:, point, 1], abs=1e-9)
    assert source.tables[0].columns[0].unit == "mm"


def test_points_that_were_lost_are_not_measured(tmp_path: Path) -> None:
    write_frames(tmp_path / "dice", FLAT, "dice")
    file = tmp_path / "dice" / "DICe_solution_3.txt"
    lines = file.read_text(encoding="utf-8").splitlines()
    fields = lines[5].split(",")
    lines[5] = ",".join([*fields[:5], "-1", *fields[6:]])
    file.write_text("\n".join(lines), encoding="utf-8")
    values = read_source(tmp_path / "dice").find("p0004.x", "")[1].values
    assert np.flatnonzero(np.isnan(values)).tolist() == [3]


def test_frames_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    many = field(2, frames=12)
    write_frames(tmp_path / "dice", many, "dice")
    values = read_source(tmp_path / "dice").find("p0019.x", "")[1].values
    assert np.all(np.diff(values) > 0)


def test_a_sheet_with_points_in_pixels_and_a_force_file(tmp_path: Path) -> None:
    write_frames(tmp_path / "sheet", FLAT, "dice")
    rows = [f"{k},{0.05 * 4 * k / 5:.6f},{-0.02 * k:.4f}" for k in range(6)]
    (tmp_path / "sheet" / "pad.csv").write_text(
        "\n".join(["time (s),pos_x (mm),Fx (N)", *rows]), encoding="utf-8"
    )
    answers = {
        **BODY,
        "[[clock]] rate_hz": "1.0",
        "[beads] unit": '"0.5 mm"',
        "[beads] plane_z": "0.005",
        "[frame] origin": "[0.008, 0.007, 0.0]",
    }
    found, asked = imported(tmp_path / "sheet", tmp_path / "pull", answers)
    assert "[beads] plane_z" in asked
    places = 0.5e-3 * (FLAT.reference + FLAT.displacement)
    # an image's y points down
    assert found.fiducials[:, :, 0] == pytest.approx(places[..., 0] - 0.008, abs=1e-9)
    assert found.fiducials[:, :, 1] == pytest.approx(-(places[..., 1] - 0.007), abs=1e-9)
    assert np.isnan(found.fiducials[:, :, 2]).all()
    assert found.fiducials_rest[:, 2] == pytest.approx(0.005)
    assert found.wrench[:, 0] == pytest.approx(-0.02 * np.arange(6), abs=1e-9)


def test_of_hundreds_of_points_thirty_are_taken_evenly_spread(tmp_path: Path) -> None:
    x, y = (values.ravel() for values in np.meshgrid(np.arange(20.0), np.arange(20.0)))
    grid = np.stack([x, y], axis=1)
    write_frames(tmp_path / "dice", Field(grid, np.zeros((3, 400, 2))), "dice")
    text = import_experiment(tmp_path / "dice", tmp_path / "out").mapping.read_text(encoding="utf-8")
    chosen = [int(number) for number in re.findall(r'\["p(\d{4})\.x"', text)]
    assert len(chosen) == 30
    apart = np.linalg.norm(grid[chosen][:, None] - grid[chosen][None], axis=2) + 99 * np.eye(30)
    assert apart.min() >= 3.0
    assert "30 of 400 points" in text


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


@pytest.mark.parametrize(
    ("begin", "line", "said"),
    [
        ("axes", 'axes = ["x", "z", "y"]', "left-handed"),
        ("axes", 'axes = ["x", "y", "u"]', "is no axis"),
        ("axes", 'axes = ["x", "x", "y"]', "at right angles"),
        ("px", 'px = { column = "nothing", unit = "mm" }', "there is no column 'nothing'"),
        ("px", 'px = { column = "Position x (mm)", unit = "N" }', "is no unit of length"),
        (
            "px",
            'qq = { column = "Position x (mm)", unit = "mm" }',
            "[columns] qq is nothing of an experiment",
        ),
        ("first", "first = 0", "[rows] first to last is 0 to 24"),
        ("# last", "last = 99", "there are 24 rows"),
        ("shape", 'shape = "ball"', "write one of block, cylinder, surface"),
        ("surface_below", 'surface_below = "water"', "write one of table, none"),
        ("format", 'format = "retraction-import/9"', 'only "retraction-import/1"'),
        ("size", "size = 3", "write three numbers"),
        ("table", 'table = "other"', "there is no table 'other'"),
    ],
)
def test_a_mapping_that_contradicts_the_source_is_refused_in_one_line(
    begin: str, line: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_csv(MEASURED, tmp_path / "a.csv")
    mapping = import_experiment(tmp_path / "a.csv", tmp_path / "a").mapping
    completed(mapping, BODY)
    changed = re.sub(
        rf"^{begin} = .*$", lambda _: line, mapping.read_text(encoding="utf-8"), count=1, flags=re.M
    )
    mapping.write_text(changed, encoding="utf-8")
    assert main(["import", str(tmp_path / "a.csv"), "--output", str(tmp_path / "a")]) == 2
    told = capsys.readouterr()
    assert said in told.err
    assert told.err.count("\n") == 1
    assert not (tmp_path / "a").exists()


def test_what_is_wrong_is_told_and_an_experiment_that_cannot_be_is_not_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_csv(MEASURED, tmp_path / "a.csv")
    mapping = import_experiment(tmp_path / "a.csv", tmp_path / "a").mapping
    completed(mapping, {**BODY, "[phantom] size": "[60.0, 30.0, 10.0]"}, axes=AXES)
    assert main(["import", str(tmp_path / "a.csv"), "--output", str(tmp_path / "a")]) == 2
    said = capsys.readouterr().out
    assert "not written" in said
    assert "if these are millimetres" in said
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.csv", b""),
        ("a.csv", b"only words\nand more\n"),
        ("a.csv", b"\x00\x01\x02" * 50),
        ("a.xlsx", b"PK\x03\x04" + b"\x00" * 100),
        ("a.npz", b"PK\x03\x04" + b"\x00" * 100),
        ("a.h5", b"\x89HDF\r\n\x1a\n" + b"\x00" * 100),
        ("a.mat", b"MATLAB 5.0 MAT-file" + b"\x00" * 300),
        ("a.c3d", b"\x02\x50" + b"\x00" * 600),
        ("a.c3d", b"\x02\x50"),
    ],
)
def test_a_damaged_file_is_refused_in_one_line(
    name: str, content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(content)
    assert main(["import", str(tmp_path / name), "--output", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"retract: {tmp_path / name}")
    assert told.count("\n") == 1


@pytest.mark.parametrize(
    "name", ["trial.xlsx", "trial.npz", "trial.h5", "trial.mat", "trial73.mat", "trial.c3d"]
)
def test_a_file_that_is_cut_off_anywhere_is_refused_or_read(name: str, tmp_path: Path) -> None:
    FORMATS[name](MEASURED, tmp_path / name)
    content = (tmp_path / name).read_bytes()
    # each of MATLAB's takes a process of its own
    cuts = 5 if name == "trial.mat" else 25
    for end in np.linspace(1, len(content) - 1, cuts).astype(int):
        (tmp_path / f"cut_{name}").write_bytes(content[:end])
        try:
            read_source(tmp_path / f"cut_{name}")
        except InputError as refusal:
            assert f"cut_{name}" in str(refusal)


def test_a_matlab_file_whose_library_crashes_is_refused_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_mat5(MEASURED, tmp_path / "a.mat")
    crashing = tmp_path / "crashing.py"
    crashing.write_text("import os, signal\nos.kill(os.getpid(), signal.SIGABRT)\n", encoding="utf-8")
    monkeypatch.setattr(matlab, "_WORKER", crashing)
    with pytest.raises(InputError, match=r"is not readable as a MATLAB file \(it is damaged\)"):
        read_source(tmp_path / "a.mat")


def test_a_frame_in_which_a_number_is_missing_leaves_that_point_out(tmp_path: Path) -> None:
    write_frames(tmp_path / "dice", FLAT, "dice")
    file = tmp_path / "dice" / "DICe_solution_3.txt"
    lines = file.read_text(encoding="utf-8").splitlines()
    lines[1] = lines[1].replace("0,", "?,", 1)
    file.write_text("\n".join(lines), encoding="utf-8")
    assert len(read_source(tmp_path / "dice").tables[0].columns) == 2 * (len(FLAT.reference) - 1)


def test_pickled_objects_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", objects=np.array([{"a": 1}], dtype=object))
    with pytest.raises(InputError, match="pickled objects"):
        read_source(tmp_path / "a.npz")


def test_one_frame_tells_no_motion_and_the_folder_is_asked_for(tmp_path: Path) -> None:
    write_frames(tmp_path / "dice", FLAT, "dice")
    with pytest.raises(InputError, match="name the folder"):
        read_source(tmp_path / "dice" / "DICe_solution_0.txt")


def test_units_of_a_dataset_are_those_of_its_attribute(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as store:
        store["t"] = np.arange(10.0)
        store["t"].attrs["unit"] = "ms"
        store["force"] = np.arange(10.0)
    text = import_experiment(tmp_path / "a.h5", tmp_path / "a").mapping.read_text(encoding="utf-8")
    assert 'time = { column = "t", unit = "ms" }' in text
    assert 'f = { column = "force", unit = "?" }' in text
