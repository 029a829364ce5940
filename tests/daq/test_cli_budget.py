"""The verb ``budget``: what a rig and a trajectory let one expect, before anything is recorded."""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from daq.cli import main
from daq.rig import read_rig, write_rig
from daq.virtual_rig.layout import Addresses, rig_description
from daq.virtual_rig.rendering.scene import flea2_pair
from daq.vision.planar import PlanarView
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fit.estimate import estimate
from estimator.forward.meshing import mesh_experiment

_TINY = Grading(8e-3, 15e-3, 30e-3, 3.0, 1)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = partial(mesh_experiment, grading=_TINY)
    monkeypatch.setattr("daq.cli.estimation.budget.estimate", partial(estimate, mesh=mesh, finer_mesh=mesh))
    monkeypatch.setattr("daq.cli.estimation.budget.DEFAULT_GRADING", _TINY)


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    described = rig_description(
        Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2")), tmp_path / "stereo.toml"
    )
    write_rig(described, tmp_path / "lab.toml")
    return tmp_path / "lab.toml"


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "mine.csv"
    path.write_text("x_m,y_m,z_m,rz_rad,phase\n0.004,0,0,0,hold\n0.008,0,0.002,0.2,hold\n")
    return path


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = main(["budget", *(str(argument) for argument in arguments)])
    out, err = capsys.readouterr()
    return status, out, err


def test_nothing_is_connected_and_every_size_has_an_origin(
    capsys: pytest.CaptureFixture[str], rig: Path, table: Path, tmp_path: Path
) -> None:
    report = tmp_path / "plan.html"
    status, out, _ = run(
        capsys, rig, "--trajectory", table, "--uncertainty", "force_gain=0.005", "--report", report, "--json"
    )
    assert status == 0
    told = json.loads(out)
    origins = {one["source"]["name"]: one["source"]["origin"]["words"] for one in told["budget"]["lines"]}
    assert origins["force"].startswith("data sheet of netft")
    assert origins["position"] == "uncertainty in the rig file"
    assert origins["force_gain"] == "stated by --uncertainty"
    assert origins["thickness"].startswith("assumed: ")
    gain = next(one for one in told["budget"]["lines"] if one["source"]["name"] == "force_gain")
    assert gain["contribution"]["youngs_modulus"] == pytest.approx(0.005 * 15e3, rel=0.03)
    assert "Expected uncertainty of" in report.read_text(encoding="utf-8")


@pytest.mark.parametrize("calibrated", [True, False])
def test_one_camera_plans_with_what_it_measures(
    capsys: pytest.CaptureFixture[str], rig: Path, table: Path, calibrated: bool
) -> None:
    camera = rig.with_name("camera.toml")
    flea2_pair().left.save(camera)
    described = read_rig(rig)
    one = replace(
        described,
        cameras=described.cameras[:1],
        stereo_calibration=None,
        planar_view=PlanarView(camera, 2e-4) if calibrated else None,
    )
    write_rig(one, rig)
    status, out, err = run(capsys, rig, "--trajectory", table, "--json")
    assert status == 0, err
    counted = {line["source"]["name"] for line in json.loads(out)["budget"]["lines"]}
    assert ("bead" in counted) == calibrated
    assert "force" in counted


def test_more_of_the_same_trials_lessen_noise_and_no_gain(
    capsys: pytest.CaptureFixture[str], rig: Path, table: Path
) -> None:
    plan = table.parent / "plan.toml"
    plan.write_text(
        'format = "retraction-plan/1"\n[[trials]]\ntrajectory = "mine.csv"\nrepeat = 2\n', encoding="utf-8"
    )
    contributions = []
    for options in (("--trajectory", table), ("--plan", plan)):
        status, out, _ = run(capsys, rig, *options, "--json")
        assert status == 0
        lines = json.loads(out)["budget"]["lines"]
        contributions.append({one["source"]["name"]: one["contribution"]["youngs_modulus"] for one in lines})
    once, twice = contributions
    assert twice["force"] == pytest.approx(once["force"] / 2**0.5, rel=0.02)
    assert twice["force_gain"] == pytest.approx(once["force_gain"], rel=0.02)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--trajectory", "still.csv"], "the gripper never leaves its pose at rest"),
        (["--trajectory", "missing.csv"], "missing.csv"),
        (["--plan", "missing.toml"], "missing.toml"),
        (["--trajectory", "pull", "--uncertainty", "wind=1"], "no uncertainty is called 'wind'"),
    ],
)
def test_a_plan_that_cannot_be_is_refused_in_a_line(
    capsys: pytest.CaptureFixture[str],
    rig: Path,
    monkeypatch: pytest.MonkeyPatch,
    options: list[str],
    complaint: str,
) -> None:
    monkeypatch.chdir(rig.parent)
    (rig.parent / "still.csv").write_text("x_m,y_m,z_m,phase\n0,0,0,hold\n", encoding="utf-8")
    status, out, err = run(capsys, rig, *options)
    assert (status, out) == (2, "")
    assert complaint in err
    assert err.count("\n") == 1
