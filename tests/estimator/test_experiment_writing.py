"""Experiment folders that are written, and cases of several."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from handwritten_experiment import as_surface, assert_equal, edit, write_cube_stl, written_by_hand
from surface_files import BLOCK_FACES, BLOCK_VERTICES, obj_text, ply_file, stl_binary, vtp_file

from estimator.errors import InputError
from estimator.experiment import (
    Phantom,
    read_case,
    read_experiment,
    replace_experiment,
    write_experiment,
)
from estimator.experiment.mounting import is_same_body
from estimator.geometry.shapes import block_surface
from estimator.inference.channels import channel_variance
from estimator.surfaces.reading import surface_bounds


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return written_by_hand(tmp_path / "P07" / "pull")


def test_what_is_written_reads_back_the_same(folder: Path, tmp_path: Path) -> None:
    original = replace(read_experiment(folder), name='say "pull" ü \x7f\n')
    written = write_experiment(original, tmp_path / "new" / "copy")
    assert written.path == tmp_path / "new" / "copy"
    assert ",-0.5,,,0.0," in (written.path / "observations.csv").read_text().splitlines()[2]
    again = read_experiment(written.path)
    np.testing.assert_allclose(again.quaternion_wxyz, original.quaternion_wxyz, rtol=0, atol=4e-16)
    assert_equal(replace(again, quaternion_wxyz=original.quaternion_wxyz), original)


def test_what_is_loaded_and_heavy_reads_back_the_same(folder: Path, tmp_path: Path) -> None:
    original = read_experiment(folder)
    hung = replace(
        original,
        environment=replace(original.environment, weight="acts"),
        sensor=replace(original.sensor, force_zero="no_load", orientation_std=0.01),
        first_row="under_load",
    )
    assert_equal(read_experiment(write_experiment(hung, tmp_path / "hung").path), hung)
    carrying = replace(hung, driven="load", wrench=np.nan_to_num(hung.wrench))
    assert_equal(read_experiment(write_experiment(carrying, tmp_path / "carrying").path), carrying)


def test_a_first_row_free_of_stress_is_left_out_once_it_is_read(folder: Path, tmp_path: Path) -> None:
    original = read_experiment(folder)
    moulded = replace(original, environment=replace(original.environment, weight="acts_after_first_row"))
    read = read_experiment(write_experiment(moulded, tmp_path / "moulded").path)
    assert len(read.time) == len(original.time) - 1
    assert (read.environment.weight, read.first_row, read.sensor.force_zero) == (
        "acts",
        "under_load",
        "no_load",
    )
    np.testing.assert_array_equal(read.wrench, original.wrench[1:])


def test_what_is_empty_of_a_known_load_is_zero(folder: Path, tmp_path: Path) -> None:
    original = read_experiment(folder)
    sensor = replace(original.sensor, orientation_std=0.01)
    read = read_experiment(
        write_experiment(replace(original, driven="load", sensor=sensor), tmp_path / "load").path
    )
    np.testing.assert_array_equal(read.wrench, np.nan_to_num(original.wrench))
    assert np.isnan(original.wrench).any()


def test_a_surface_is_written_with_its_experiment(folder: Path, tmp_path: Path) -> None:
    as_surface(folder)
    write_cube_stl(folder / "phantom.stl", 0.05)
    written = write_experiment(read_experiment(folder), tmp_path / "copy")
    assert written.phantom.surface == tmp_path / "copy" / "phantom.stl"
    assert read_experiment(tmp_path / "copy").phantom == written.phantom
    assert (tmp_path / "copy" / "phantom.stl").read_bytes() == (folder / "phantom.stl").read_bytes()


@pytest.mark.parametrize("name", ["lobe.PLY", "lobe.vtp", "lobe.obj", "lobe.stl", "lobe.dat"])
def test_a_surface_of_any_format_and_unit_goes_with_its_experiment(
    folder: Path, tmp_path: Path, name: str
) -> None:
    vertices, faces = ([1e3, 1.25e3, 1e3] * np.array(BLOCK_VERTICES)).tolist(), BLOCK_FACES
    content = {
        "lobe.PLY": ply_file(vertices, faces, "binary_big_endian"),
        "lobe.vtp": vtp_file(vertices, faces, form="appended", compressor="vtkLZMADataCompressor"),
        "lobe.obj": obj_text(vertices, faces).encode(),
    }.get(name, stl_binary(1e3 * block_surface((0.1, 0.1, 0.01)).corners))
    (folder / name).write_bytes(content)
    edit(folder / "experiment.toml", 'shape = "block"', f'shape = "surface"\nsurface = "{name}"\nunit = "mm"')
    original = read_experiment(folder)
    assert surface_bounds(folder / name, "mm") == pytest.approx(
        np.array([[-0.05, -0.05, -0.005], [0.05, 0.05, 0.005]])
    )
    written = write_experiment(original, tmp_path / "copy")
    assert written.phantom.surface is not None
    assert written.phantom.surface.name == "phantom" + {"lobe.dat": ""}.get(name, name[4:].lower())
    assert written.phantom.surface.read_bytes() == content
    again = read_experiment(tmp_path / "copy").phantom
    assert again == written.phantom
    assert again.unit == "mm"
    replace_experiment(replace(original, order=7), tmp_path / "copy")
    assert read_experiment(tmp_path / "copy").order == 7


def test_writing_over_an_experiment_needs_the_other_function(folder: Path) -> None:
    changed = replace(read_experiment(folder), order=5)
    with pytest.raises(InputError, match="exists already"):
        write_experiment(changed, folder)
    assert read_experiment(folder).order == 2
    replace_experiment(changed, folder)
    assert read_experiment(folder).order == 5


def test_replacing_never_deletes_what_is_no_experiment(folder: Path, tmp_path: Path) -> None:
    experiment = read_experiment(folder)
    (folder / "notes.txt").write_text("keep me")
    with pytest.raises(InputError, match=r"holds notes\.txt, which would be lost"):
        replace_experiment(experiment, folder)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="is no experiment folder"):
        replace_experiment(experiment, tmp_path / "empty")
    assert (folder / "notes.txt").read_text() == "keep me"


def test_an_experiment_that_would_not_read_is_not_written(folder: Path, tmp_path: Path) -> None:
    experiment = read_experiment(folder)
    backwards = replace(experiment, time=-experiment.time)
    with pytest.raises(
        InputError, match=r"copy.observations\.csv, line 3, column time: time does not ascend"
    ):
        write_experiment(backwards, tmp_path / "out" / "copy")
    short = replace(experiment, wrench=experiment.wrench[:3])
    with pytest.raises(InputError, match=r"wrench has the shape \(3, 6\); with 7 times it must be \(7, 6\)"):
        write_experiment(short, tmp_path / "out" / "copy")
    assert not (tmp_path / "out").exists()


def test_a_failed_write_leaves_nothing_behind(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full_disk(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr("estimator.experiment.writing.write_observations", full_disk)
    with pytest.raises(OSError, match="no space"):
        write_experiment(read_experiment(folder), tmp_path / "out" / "copy")
    assert list((tmp_path / "out").iterdir()) == []


def test_a_case_is_read_in_the_order_of_its_experiments(folder: Path) -> None:
    experiment = read_experiment(folder)
    for name, order in (("a", 3), ("b", 1)):
        write_experiment(replace(experiment, name=name, order=order), folder.parent / name)
    (folder.parent / "truth.toml").write_text("effects = []")
    (folder.parent / "reports").mkdir()
    assert [member.name for member in read_case(folder.parent)] == ["b", "first pull", "a"]


def test_one_experiment_is_a_case_of_one(folder: Path) -> None:
    assert [member.name for member in read_case(folder)] == ["first pull"]


def test_a_case_of_two_phantoms_is_refused(folder: Path) -> None:
    write_experiment(replace(read_experiment(folder), phantom_id="P08"), folder.parent / "other")
    with pytest.raises(InputError, match=r"experiments of 2 phantoms \(P07, P08\)"):
        read_case(folder.parent)


def test_a_folder_without_experiments_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"neither it nor a folder in it holds experiment\.toml"):
        read_case(tmp_path)


def test_single_channels_may_have_a_noise_of_their_own(folder: Path, tmp_path: Path) -> None:
    experiment = read_experiment(folder)
    sensor = replace(experiment.sensor, by_channel={"fz": 0.5, "z": 3e-4})
    written = write_experiment(replace(experiment, sensor=sensor), tmp_path / "own")
    found = read_experiment(written.path or "")
    assert found.sensor == sensor
    usual = channel_variance(experiment)
    own = channel_variance(found)
    expected = usual.copy()
    expected[2] = 0.25
    expected[8::3] = 9e-8
    assert np.allclose(own, expected)


@pytest.mark.parametrize("by_channel", [{"fz": 0.0}, {"fq": 0.1}, {"x": -1e-4}])
def test_a_noise_of_a_channel_that_none_has_is_refused(
    folder: Path, tmp_path: Path, by_channel: dict[str, float]
) -> None:
    experiment = read_experiment(folder)
    sensor = replace(experiment.sensor, by_channel=by_channel)
    with pytest.raises(InputError, match=r"\[sensor.by_channel\] "):
        write_experiment(replace(experiment, sensor=sensor), tmp_path / "own")


def test_a_surface_in_two_folders_is_one_body_by_what_its_files_hold(tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("one.stl", "same.stl", "other.stl")]
    for file, faces in zip(files, (BLOCK_FACES, BLOCK_FACES, BLOCK_FACES[::-1]), strict=True):
        halves = [half for a, b, c, d in faces for half in ((a, b, c), (a, c, d))]
        file.write_bytes(stl_binary(np.array(BLOCK_VERTICES)[halves]))
    one, same, other = (Phantom("surface", (0.06, 0.03, 0.01), file) for file in files)
    assert is_same_body(one, same)
    assert not is_same_body(one, other)
    assert not is_same_body(one, Phantom("block", (0.06, 0.03, 0.01)))
