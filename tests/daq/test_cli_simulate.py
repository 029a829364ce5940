"""The verb ``simulate``, on a mesh that costs little."""

import json
import re
import tomllib
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from daq.cli import main
from daq.trajectories import STANDARD
from daq.trajectories.routines import NAMED, RETRACTIONS
from estimator.errors import InputError
from estimator.experiment import Experiment, read_case, write_experiment
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


@pytest.mark.parametrize("name", RETRACTIONS)
def test_every_trajectory_that_is_offered_is_simulated(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str
) -> None:
    status, _, err = run(capsys, "--trajectory", name, "--output", tmp_path / "case")
    assert (status, [line for line in err.splitlines() if line.startswith("retract: ")]) == (0, [])
    (experiment,) = read_case(tmp_path / "case")
    assert experiment.name == name
    assert np.ptp(experiment.position, axis=0).max() > 4e-3


@pytest.mark.parametrize("name", STANDARD)
def test_a_retraction_that_holds_is_measured_so_long_after(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str
) -> None:
    times = {}
    for hold in ((), ("--hold", 5, "--hold", 20)):
        target = tmp_path / f"case{len(hold)}"
        assert run(capsys, "--trajectory", name, *hold, "--output", target)[0] == 0
        (experiment,) = read_case(target)
        times[len(hold)] = experiment.time
    assert len(times[4]) == len(times[0]) + 2


def test_the_help_offers_what_can_be_simulated(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["simulate", "--help"])
    told = re.sub(r"\s+", " ", capsys.readouterr().out)
    assert f"{', '.join(RETRACTIONS)}; or" in told


def refuse_to_solve(*_: object) -> None:
    raise AssertionError("something was solved")


@pytest.mark.parametrize("name", sorted(set(NAMED) - set(RETRACTIONS)))
def test_a_motion_for_calibrations_is_refused_before_anything_is_solved(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr("daq.cli.estimation.simulate.simulate_case", refuse_to_solve)
    status, out, err = run(
        capsys, "--trajectory", "pull", "--trajectory", name, "--output", tmp_path / "case"
    )
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert f"--trajectory {name}: is a motion for calibrations" in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("stops", [1, 3])
def test_a_trajectory_that_stays_at_rest_is_refused_before_anything_is_solved(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stops: int
) -> None:
    monkeypatch.setattr("daq.cli.estimation.simulate.simulate_case", refuse_to_solve)
    table = tmp_path / "still.csv"
    table.write_text("x_m,y_m,z_m\n" + "0,0,0\n" * stops)
    status, _, err = run(capsys, "--trajectory", table, "--output", tmp_path / "case")
    assert (status, err.count("\n")) == (2, 1)
    assert "never leaves its pose at rest" in err


def test_what_cannot_be_written_leaves_nothing_behind(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[Path] = []

    def write_first(experiment: Experiment, target: Path) -> Experiment:
        if written:
            raise InputError("the second cannot be written")
        written.append(target)
        return write_experiment(experiment, target)

    monkeypatch.setattr("daq.cli.estimation.simulate.write_experiment", write_first)
    status, _, err = run(
        capsys, "--trajectory", path, "--trajectory", path, "--output", tmp_path / "out" / "case"
    )
    assert status == 2
    assert "the second cannot be written" in err
    assert len(written) == 1
    assert list((tmp_path / "out").iterdir()) == []
