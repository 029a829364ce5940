"""`retract import` of image correlations: points are followed, of whichever program they are."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from import_cases import BODY, FLAT, SOLID, imported
from import_files import (
    NCORR_MM,
    NCORR_SPACING,
    Field,
    field,
    write_frames,
    write_mudic_npz,
    write_ncorr,
    write_ncorr73,
)

from estimator.importing import import_experiment, read_source

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
