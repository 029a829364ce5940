"""`retract import` of what contradicts itself, is damaged, or cannot be an experiment: one line each."""

import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from import_cases import BODY, FLAT, FORMATS, MEASURED, completed
from import_files import (
    AXES,
    write_csv,
    write_frames,
    write_mat5,
)

from daq.cli import main
from estimator.errors import InputError
from estimator.importing import import_experiment, read_source
from estimator.importing.formats import matlab


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
