"""The verb ``simulate``, on a mesh that costs little."""

import json
import tomllib
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from daq.cli import main
from estimator.experiment import read_case
from estimator.fem.discretisation.block_mesh import Grading
from estimator.simulation.simulate import Resolution, simulate_case

TINY = Resolution(Grading(8e-3, 15e-3, 30e-3, 3.0, 1), "hex27")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("daq.cli.estimation.simulate.simulate_case", partial(simulate_case, resolution=TINY))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A trajectory of one's own: out in two steps, and back."""
    table = tmp_path / "mine.csv"
    table.write_text(
        "x_m,y_m,z_m,rz_rad,phase\n0.004,0,0,0,hold\n0.008,0,0.002,0.2,hold\n0.004,0,0,0,return_hold\n"
    )
    return table


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = main(["simulate", *(str(argument) for argument in arguments)])
    out, err = capsys.readouterr()
    return status, out, err


def test_a_case_differs_from_the_one_without_effect_by_the_effect(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, path: Path
) -> None:
    usual = ("--trajectory", path, "--seed", 5)
    assert run(capsys, *usual, "--output", tmp_path / "null")[0] == 0
    effects = ("--effect", "force_bias:tissue_frame=bias_fz=0.25", "--effect", "camera_scale=0.02")
    status, out, _ = run(capsys, *usual, *effects, "--output", tmp_path / "case", "--json")
    assert status == 0
    assert json.loads(out)["experiments"] == [str(tmp_path / "case" / "mine")]
    (null,), (case,) = read_case(tmp_path / "null"), read_case(tmp_path / "case")
    change = case.wrench - null.wrench
    np.testing.assert_allclose(change[:, 2], 0.25, atol=1e-9)
    np.testing.assert_allclose(change[:, [0, 1, 3, 4, 5]], 0.0, atol=1e-9)
    noise = 6 * case.sensor.fiducial_std * 0.02
    np.testing.assert_allclose(case.fiducials - null.fiducials, 0.02 * null.fiducials, atol=noise)
    np.testing.assert_array_equal(case.position, null.position)
    truth = tomllib.loads((tmp_path / "case" / "truth.toml").read_text(encoding="utf-8"))
    assert truth["effects"] == ["force_bias", "camera_scale"]
    assert truth["parameters"]["camera_scale:uniform"] == {"scale_error": 0.02}
    assert truth["parameters"]["force_bias:tissue_frame"]["bias_fz"] == 0.25


def test_any_law_and_place_are_told_in_the_truth_and_trajectories_keep_their_order(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, path: Path
) -> None:
    status, _, _ = run(
        capsys,
        *("--trajectory", path, "--trajectory", path, "--law", "yeoh2", "--shape", 0.3),
        *("--effect", "inhomogeneity=0.7,centre_x=0.01,radius=0.012"),
        *("--output", tmp_path / "case"),
    )
    assert status == 0
    experiments = read_case(tmp_path / "case")
    assert [(one.name, one.order) for one in experiments] == [("mine", 1), ("mine_2", 2)]
    truth = tomllib.loads((tmp_path / "case" / "truth.toml").read_text(encoding="utf-8"))
    assert truth["effects"] == ["strain_stiffening", "inhomogeneity"]
    assert truth["parameters"]["law"] == "yeoh2"
    assert truth["where"] == {"centre": [0.01, 0.0, 0.0], "radius": 0.012}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--effect", "sliding=1"), "no effect is called 'sliding'"),
        (("--effect", "gripper_slip=0.01"), "threshold (N, to be named)"),
        (("--trajectory", "nowhere.csv"), "nowhere.csv"),
        (("--poisson-ratio", "0.5"), "nu between -1 and 0.5"),
    ],
)
def test_wrong_input_ends_with_one_line_and_writes_nothing(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    status, out, err = run(capsys, *arguments, "--output", tmp_path / "case")
    assert (status, out) == (2, "")
    assert err.startswith("retract: ")
    assert err.count("\n") == 1
    assert words in err
    assert not (tmp_path / "case").exists()


def test_a_folder_that_exists_is_left_alone(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, _, err = run(capsys, "--output", tmp_path)
    assert status == 2
    assert "exists already" in err


def test_the_effects_are_listed_with_their_parameters(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["simulate", "--effects"])
    out = capsys.readouterr().out
    assert (
        "viscoelasticity:one_term: it takes relaxing_share_1 (usually 0.4), relaxation_time_1 (s, usually 8)"
        in out
    )
