"""The experiment folder: what is read, and what is refused and with which words."""

import re
from pathlib import Path

import numpy as np
import pytest
from handwritten_experiment import CSV, TOML, as_surface, assert_equal, edit, write_cube_stl, written_by_hand

from estimator.errors import InputError
from estimator.experiment import (
    Box,
    Environment,
    Phantom,
    read_case,
    read_experiment,
)

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 0.0254}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return written_by_hand(tmp_path / "P07" / "pull")


def test_an_experiment_reads_as_written_by_hand(folder: Path) -> None:
    experiment = read_experiment(folder)
    assert (experiment.name, experiment.phantom_id, experiment.order) == ("first pull", "P07", 2)
    assert experiment.phantom == Phantom("block", (0.1, 0.1, 0.01), None, 1080.0)
    assert experiment.anchors[0] == Box((-0.0501, -0.0501, -0.0051), (-0.0499, 0.0501, 0.0051))
    assert len(experiment.anchors) == 2
    assert experiment.grasp.box == Box((0.03, -0.01, -0.0051), (0.05, 0.01, 0.0051))
    assert experiment.grasp.centre == (0.04, 0.0, 0.0)
    assert experiment.trajectory_kind == "pull"
    assert experiment.environment == Environment((0.0, 0.0, -9.81), "none")
    assert (experiment.sensor.torque_std, experiment.sensor.tool_centre) == (0.0005, (0.0, 0.0, 0.06))
    assert experiment.phase[:2] == ("hold", "ramp")
    assert experiment.step.tolist() == [0, 1, 1, 2, 2, 3, 3]
    assert experiment.position[3].tolist() == [0.052, 0.0, 0.0]
    assert experiment.wrench.shape == (7, 6)
    assert experiment.fiducials.shape == (7, 2, 3)
    assert experiment.fiducials[6, 1].tolist() == [-0.005, -0.03, 0.005]
    assert experiment.path == folder


def test_an_empty_field_is_a_value_that_was_not_measured(folder: Path) -> None:
    experiment = read_experiment(folder)
    assert np.flatnonzero(np.isnan(experiment.wrench[1])).tolist() == [1, 2]
    assert np.isnan(experiment.fiducials[1, 1]).all()
    assert np.isnan(experiment.wrench).sum() + np.isnan(experiment.fiducials).sum() == 5


def test_quaternions_come_back_with_unit_norm(folder: Path) -> None:
    norm = np.linalg.norm(read_experiment(folder).quaternion_wxyz, axis=1)
    np.testing.assert_allclose(norm, 1.0, rtol=0, atol=4e-16)


def test_time_counts_from_the_first_row(folder: Path) -> None:
    lines = CSV.splitlines()
    late = [f"{float(line.split(',')[0]) + 100}," + line.split(",", 1)[1] for line in lines[1:]]
    (folder / "observations.csv").write_text("\n".join([lines[0], *late]))
    assert read_experiment(folder).time.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]


def test_columns_may_stand_in_any_order_and_more_may_stand_beside_them(folder: Path) -> None:
    expected = read_experiment(folder)
    rows = [line.split(",")[::-1] for line in CSV.splitlines()]
    shuffled = [",".join([*row, "note" if i == 0 else "x"]) for i, row in enumerate(rows)]
    (folder / "observations.csv").write_text("\n".join(shuffled) + "\n\n")
    assert_equal(read_experiment(folder), expected)


def test_optional_keys_have_their_documented_defaults(folder: Path) -> None:
    file = folder / "experiment.toml"
    for key in ("name", "phantom_id", "order", "density", "centre", "kind", "gravity", "surface_below"):
        file.write_text(re.sub(rf"^{key} = .*\n", "", file.read_text(), flags=re.MULTILINE))
    for key in ("tool_mass", "tool_centre"):
        file.write_text(re.sub(rf"^{key} = .*\n", "", file.read_text(), flags=re.MULTILINE))
    experiment = read_experiment(folder)
    assert (experiment.name, experiment.phantom_id, experiment.order) == ("pull", "P07", 1)
    assert experiment.phantom.density == 1070.0
    assert experiment.grasp.centre == pytest.approx((0.04, 0.0, 0.0))
    assert experiment.trajectory_kind == "other"
    assert experiment.environment == Environment((0.0, 0.0, -9.81), "table")
    assert (experiment.sensor.tool_mass, experiment.sensor.tool_centre) == (0.0, (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("edits", "message"),
    [
        (
            {'surface_below = "none"': 'surface_below = "table"\nweight = "acts"'},
            "a table carries the phantom",
        ),
        (
            {'surface_below = "none"': 'surface_below = "none"\nweight = "hangs"'},
            "write one of left_out, acts",
        ),
        ({"gravity = [0.0, 0.0, -9.81]": 'gravity = [0.0, 0.0, 0.0]\nweight = "acts"'}, "gravity is zero"),
        ({'kind = "pull"': 'kind = "pull"\ndriven = "load"'}, "state .sensor. orientation_std in rad"),
        (
            {"force_std = 0.02": "force_std = 0.02\norientation_std = 2"},
            "orientation_std is 2 rad; write radians",
        ),
        ({"force_std = 0.02": 'force_std = 0.02\nforce_zero = "never"'}, "write one of first_row, no_load"),
        (
            {
                'kind = "pull"': 'kind = "pull"\nfirst_row = "under_load"',
                'surface_below = "none"': 'surface_below = "none"\nweight = "acts_after_first_row"',
            },
            "the weight acts only after it",
        ),
    ],
)
def test_what_contradicts_itself_of_weight_and_load_is_told_in_one_line(
    folder: Path, edits: dict[str, str], message: str
) -> None:
    edit(folder / "experiment.toml", "retraction-experiment/1", "retraction-experiment/2")
    for old, new in edits.items():
        edit(folder / "experiment.toml", old, new)
    with pytest.raises(InputError, match=message):
        read_experiment(folder)


def test_an_experiment_without_cameras_has_no_fiducials(folder: Path) -> None:
    (folder / "experiment.toml").write_text(TOML.split("[fiducials]")[0])
    (folder / "observations.csv").write_text(
        "".join(",".join(line.split(",")[:16]) + "\n" for line in CSV.splitlines())
    )
    experiment = read_experiment(folder)
    assert experiment.fiducials_rest.shape == (0, 3)
    assert experiment.fiducials.shape == (7, 0, 3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"retraction-experiment/1"', '"retraction-experiment/3"', r"format is .*/3.*only .*/1 and .*/2"),
        ("[sensor]", 'weight = "acts"\n[sensor]', r'weight needs format = "retraction-experiment/2"'),
        (
            "[grasp]",
            '[grasp]\npainted = "a.ply"',
            r'\[grasp\] painted needs format = "retraction-experiment/2"',
        ),
        ("[grasp]", '[grasp]\ndirections = ["z"]', r"\[grasp\] directions needs format"),
        ("[grasp]", '[[anchor]]\npainted = "a.ply"\n[grasp]', r"\[\[anchor\]\] 3 painted needs format"),
        ("[grasp]", '[[roller]]\ndirections = ["z"]\n[grasp]', r"roller needs format"),
        ("[grasp]", '[[anchor]]\ndirections = ["z"]\n[grasp]', r"head that table with \[\[roller\]\]"),
        ('shape = "block"', 'shape = "block"\nstays_flat = true', r"\[phantom\] stays_flat needs format"),
        ("[grasp]", '[[phantom.region]]\nname = "a"\n[grasp]', r"\[phantom\] region needs format"),
        ('format = "retraction-experiment/1"', "", r"experiment\.toml: format is missing"),
        ("order = 2", "order = 2.5", r"order is 2\.5; write a whole number"),
        ("order = 2", "order = 0", r"number the experiments from 1"),
        ("order = 2", "order = ", r"not readable as TOML: .*line 4"),
        ('shape = "block"', 'shape = "ball"', r'\[phantom\] shape is "ball"; write one of block, surface'),
        ("size = [0.10, 0.10, 0.01]", "size = [0.1, 0.1]", r"\[phantom\] size is .*write three numbers"),
        ("size = [0.10, 0.10, 0.01]", "size = [0.1, nan, 0.1]", r"\[phantom\] size is .*write three numbers"),
        ("size = [0.10, 0.10, 0.01]", "", r"\[phantom\] size is missing"),
        ("size = [0.10, 0.10, 0.01]", "size = [0.1, 0.1, 0.0]", r"every edge must be above 0"),
        ("size = [0.10, 0.10, 0.01]", "size = [100, 100, 10]", r"edge of 100 m; write metres"),
        ("density = 1080.0", "density = 1.08", r"density is 1\.08.*write kg/m3"),
        (
            "[[0.03, -0.01, -0.0051], [0.05, 0.01, 0.0051]]",
            "[0.03, 0.05]",
            r"\[grasp\] box .*opposite corners",
        ),
        (
            "[[0.03, -0.01, -0.0051], [0.05, 0.01, 0.0051]]",
            "[[30, -10, -5.1], [50, 10, 5.1]]",
            r"\[grasp\] box holds no tissue .*metres",
        ),
        (
            "[[0.03, -0.01, -0.0051], [0.05, 0.01, 0.0051]]",
            "[[0.05, 0.05, -0.01], [0.06, 0.06, 0.01]]",  # touches along an edge
            r"\[grasp\] box holds no tissue",
        ),
        (
            "[[-0.0499, 0.0501, 0.0051], [-0.0501,",
            "[[-0.06, 0.0501, 0.0051], [-0.07,",
            r"\[\[anchor\]\] 1 box holds no",
        ),
        ("[0.05, 0.01, 0.0051]]", "[0.05, 0.0499, 0.0051]]", r"\[\[anchor\]\] 2 box overlaps \[grasp\]"),
        ("centre = [0.04, 0.0, 0.0]", "centre = [40, 0.0, 0.0]", r"line 2: the gripper starts 39\.96 m off"),
        ('kind = "pull"', 'kind = "push"', r"\[trajectory\] kind is .push.; write one of pull, "),
        ("-9.81", "-9810", r"gravity is 9810 m/s2"),
        ('surface_below = "none"', 'surface_below = "sea"', r"\[environment\] surface_below is"),
        ("force_std = 0.02", "force_std = 0", r"\[sensor\] force_std is 0; .*above 0 N"),
        ("torque_std = 0.0005", 'torque_std = "low"', r"torque_std is 'low'; write a finite number"),
        ("fiducial_std = 5.0e-5", "fiducial_std = -1.0", r"fiducial_std is -1; .*above 0 m"),
        ("fiducial_std = 5.0e-5", "fiducial_std = 0.05", r"fiducial_std is 0\.05 m on a phantom of 0\.1 m"),
        ("position_std = 3.0e-5", "", r"\[sensor\] position_std is missing"),
        ("tool_mass = 0.35", "tool_mass = 350", r"tool_mass is 350 kg; .*kilograms"),
        ("[0.0, 0.0, 0.06]", "[0.0, 0.0, 60.0]", r"tool_centre is metres away"),
        ("[-0.01, -0.03, 0.005]]", "[-10, -30, 5]]", r"rest number 1 .*off the phantom; write metres"),
        ("[-0.01, -0.03, 0.005]]", "[-0.01, -0.03]]", r"rest number 1 .*write three numbers"),
    ],
)
def test_a_false_statement_is_refused_with_its_key(folder: Path, old: str, new: str, message: str) -> None:
    edit(folder / "experiment.toml", old, new)
    with pytest.raises(InputError, match=message) as caught:
        read_experiment(folder)
    assert "\n" not in str(caught.value)
    assert str(folder) in str(caught.value)


def test_an_experiment_without_anchor_is_refused(folder: Path) -> None:
    file = folder / "experiment.toml"
    file.write_text(re.sub(r"\[\[anchor\]\]\nbox.*\n", "", file.read_text()))
    with pytest.raises(InputError, match=r"no \[\[anchor\]\]; state at least one"):
        read_experiment(folder)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("fx,", "force,", r"line 1: column fx is missing"),
        ("fy,", "fx,", r"line 1: column fx stands there twice"),
        ("m01x,m01y,m01z", "m01x,m01y,note", r"line 1: 5 fiducial columns.*2 fiducials, which need 6 .*m01z"),
        ("m01x,m01y,m01z", "m02x,m02y,m02z", r"first difference: m01x"),
        (",", ";", r"line 1: only one column; separate the columns by commas"),
        ("1.0,hold,1,0.048", "1.0,hold,1,O.048", r"line 4, column px: 'O\.048' is no number"),
        ("-0.5,,,", "-0.5,none,,", r"line 3, column fy: 'none' is no number"),
        ("-0.5,,,", "-0.5,inf,,", r"line 3, column fy: 'inf' is infinite"),
        ("1.0,hold,1,0.048", "1.0,hold,1,", r"line 4, column px: ''.*must be known in every row"),
        ("1.0,hold,1,0.048", ",hold,1,0.048", r"line 4, column time: ''"),
        ("1.0,hold,1,0.048,0,0,1", "1.0,hold,1,0.048,0,0,nan", r"line 4, column qw: 'nan'"),
        ("1.0,hold,1", "0.5,hold,1", r"line 4, column time: time does not ascend"),
        ("1.0,hold,1", "1.0,wait,1", r"line 4, column phase: 'wait' is no phase; write one of ramp, "),
        ("1.0,hold,1", "1.0,hold,1.5", r"line 4, column step: '1\.5' is no step number"),
        ("0.048,0,0,1,0,0,0", "0.048,0,0,0.9,0,0,0", r"line 4, column qw: .*no unit quaternion"),
        (
            "0,0.04,0,0,1,0,0,0,",
            "0,0.04,0,0,0,0,0,1,",
            r"line 2: the gripper starts turned by 180.0 deg.*scalar first",
        ),
        ("0,0.04,0,0,1", "0,0.02,0,0,1", r"line 2: the gripper starts 0\.02 m off \[grasp\] centre"),
        ("hold,1,0.048", "hold,1,48", r"line 4, column px: the gripper is more than 10 phantoms away"),
        ("-0.9,0,0,0,0,0", "-900,0,0,0,0,0", r"line 4, column fx: the wrench exceeds 400 N"),
        ("-0.9,0,0,0,0,0", "-0.9,0,0,0,0,30", r"line 4, column tz: the wrench exceeds 20 N·m"),
        (
            "-0.0296,-0.03,0.005",
            "-29.6,-30,5",
            r"line 4, column m00x: a fiducial is more than 1 m away.*metres",
        ),
        ("-0.009,-0.03,0.005\n", "-0.009,-0.03\n", r"line 4: 21 fields, but the header has 22"),
    ],
)
def test_a_false_row_is_refused_with_its_line(folder: Path, old: str, new: str, message: str) -> None:
    edit(folder / "observations.csv", old, new)
    with pytest.raises(InputError, match=message) as caught:
        read_experiment(folder)
    assert "\n" not in str(caught.value)
    assert f"{folder / 'observations.csv'}, line " in str(caught.value)


def test_forces_of_the_gripper_on_the_tissue_are_refused(folder: Path) -> None:
    text = re.sub(r"(,1,0,0,0|,0\.9998.*?,0,0),-", r"\1,", CSV)
    (folder / "observations.csv").write_text(text)
    with pytest.raises(InputError, match="force grows along the gripper's motion"):
        read_experiment(folder)


def test_a_table_without_measurements_is_refused(folder: Path) -> None:
    lines = CSV.splitlines()
    bare = [",".join([*line.split(",")[:10], *[""] * 12]) for line in lines[1:]]
    (folder / "observations.csv").write_text("\n".join([lines[0], *bare]))
    with pytest.raises(InputError, match="neither a wrench nor a fiducial is given"):
        read_experiment(folder)


def test_a_table_of_one_row_is_refused(folder: Path) -> None:
    (folder / "observations.csv").write_text("\n".join(CSV.splitlines()[:2]))
    with pytest.raises(InputError, match="1 rows below the header; at least two"):
        read_experiment(folder)


@pytest.mark.parametrize("name", ["experiment.toml", "observations.csv"])
def test_a_missing_file_is_named(folder: Path, name: str) -> None:
    (folder / name).unlink()
    with pytest.raises(InputError, match=f"{name}: there is no such file"):
        read_experiment(folder)


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere: there is no such folder"):
        read_experiment(tmp_path / "nowhere")
    with pytest.raises(InputError, match="nowhere: there is no such folder"):
        read_case(tmp_path / "nowhere")


def test_a_surface_phantom_takes_its_size_from_the_surface(folder: Path) -> None:
    as_surface(folder)
    edit(folder / "experiment.toml", "size = [0.10, 0.10, 0.01]", "")
    write_cube_stl(folder / "phantom.stl", 0.05)
    phantom = read_experiment(folder).phantom
    assert (phantom.shape, phantom.surface) == ("surface", folder / "phantom.stl")
    assert phantom.size_m == pytest.approx((0.1, 0.1, 0.1))


def test_a_text_stl_reads_too(folder: Path) -> None:
    as_surface(folder)
    facet = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n"
    loops = [
        ((-0.05, -0.05, -0.005), (0.05, -0.05, -0.005), (0.05, 0.05, 0.005)),
        ((-0.05, -0.05, -0.005), (0.05, 0.05, 0.005), (-0.05, 0.05, 0.005)),
    ]
    body = "".join(facet.format("".join(f"vertex {x} {y:e} {z}\n" for x, y, z in loop)) for loop in loops)
    (folder / "phantom.stl").write_text(f"solid sheet\n{body}endsolid sheet\n")
    assert read_experiment(folder).phantom.shape == "surface"


@pytest.mark.parametrize("unit", ["mm", "cm", "m", "inch"])
def test_a_surface_is_read_in_the_unit_that_the_experiment_states(folder: Path, unit: str) -> None:
    as_surface(folder)
    edit(folder / "experiment.toml", "size = [0.10, 0.10, 0.01]", f'unit = "{unit}"')
    write_cube_stl(folder / "phantom.stl", 0.05 / METRES[unit])
    phantom = read_experiment(folder).phantom
    assert phantom.unit == unit
    assert phantom.size_m == pytest.approx((0.1, 0.1, 0.1))


def test_a_surface_in_millimetres_is_told_from_its_size(folder: Path) -> None:
    as_surface(folder)
    edit(folder / "experiment.toml", "size = [0.10, 0.10, 0.01]", "")
    write_cube_stl(folder / "phantom.stl", 50.0)
    assert read_experiment(folder).phantom.size_m == pytest.approx((0.1, 0.1, 0.1))


def test_a_surface_that_is_missing_broken_or_of_another_unit_is_refused(folder: Path) -> None:
    as_surface(folder)
    with pytest.raises(InputError, match=r"phantom\.stl: there is no such file"):
        read_experiment(folder)
    write_cube_stl(folder / "phantom.stl", 5.0)
    with pytest.raises(InputError, match=r"phantom\.stl: the surface is 10 m long if it is in metres"):
        read_experiment(folder)
    edit(folder / "experiment.toml", 'surface = "phantom.stl"', 'surface = "phantom.stl"\nunit = "feet"')
    with pytest.raises(InputError, match=r'\[phantom\] unit is "feet"; write one of mm, cm, m, inch'):
        read_experiment(folder)
    edit(folder / "experiment.toml", 'unit = "feet"', "")
    write_cube_stl(folder / "phantom.stl", 0.05)
    whole = (folder / "phantom.stl").read_bytes()
    (folder / "phantom.stl").write_bytes(whole[:-7])
    with pytest.raises(InputError, match=r"phantom\.stl: .*it is cut short"):
        read_experiment(folder)


def test_a_point_is_as_far_from_a_box_as_from_its_nearest_face_or_corner() -> None:
    box = Box((0.0, 0.0, 0.0), (1.0, 2.0, 0.0))
    points = [[0.5, 1.0, 0.0], [0.5, 1.0, -0.3], [1.3, 2.4, 0.0], [-0.2, 1.0, 0.0]]
    assert box.distance(points) == pytest.approx([0.0, 0.3, 0.5, 0.2])


def test_a_box_holds_its_faces() -> None:
    box = Box((0.0, 0.0, 0.0), (1.0, 1.0, 0.0))
    assert box.contains([[0.0, 0.5, 0.0], [1.0, 1.0, 0.0], [0.5, 0.5, 1e-9]]).tolist() == [True, True, False]
