"""The verbs of bodies: from a segmented image to the phantom, and volume meshes converted."""

import json
import sys
import tomllib
from functools import partial
from pathlib import Path

import meshio
import numpy as np
import pytest

from daq.cli import main
from estimator.experiment import PaintedPatch, read_case, read_mounted_phantom
from estimator.fem.discretisation.block_mesh import Grading
from estimator.simulation.simulate import Resolution, simulate_case
from estimator.surfaces.reading import read_surface
from tests.estimator.segmentation_files import write_by_simpleitk

ORGAN, CYST, TUMOUR = 1, 2, 3
TINY = Resolution(Grading(8e-3, 15e-3, 30e-3, 3.0, 1))


@pytest.fixture(scope="module")
def segmentation(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An ellipsoid with a cyst and a tumour in voxels of 2 x 2 x 3 mm on a turned grid."""
    index = np.moveaxis(np.indices((40, 36, 24)), 0, -1)
    labels = (np.linalg.norm((index - (20, 18, 12)) / np.array([15, 12, 7]), axis=-1) < 1).astype(np.uint8)
    labels[np.linalg.norm(index - (13, 18, 12), axis=-1) < 3.5] = CYST
    labels[np.linalg.norm(index - (25, 18, 12), axis=-1) < 4.5] = TUMOUR
    T_lps_index = np.eye(4)
    T_lps_index[:3, :3] = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]) * (2.0, 2.0, 3.0)
    T_lps_index[:3, 3] = (12.0, -30.0, 45.0)
    file = tmp_path_factory.mktemp("segmentation") / "liver.nii.gz"
    write_by_simpleitk(labels, T_lps_index, file)
    return file


def told(arguments: list[object], capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    assert main([*map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)  # type: ignore[no-any-return]


def refused(arguments: list[object], capsys: pytest.CaptureFixture[str]) -> str:
    assert main([*map(str, arguments)]) == 2
    error = capsys.readouterr().err.splitlines()
    assert error[-1].startswith("retract: ")
    return error[-1]


def test_a_phantom_with_cyst_and_tumour(
    segmentation: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "P07"
    options = [
        "--label",
        f"liver={ORGAN}",
        "--cavity",
        CYST,
        "--region",
        f"tumour={TUMOUR}:modulus_ratio=2.5",
    ]
    found = told(["phantom", segmentation, *options, "--centred", "--beads", 5, "--output", output], capsys)
    assert abs(float(str(found["volume_error"]))) < 1e-3
    assert {file.name for file in output.iterdir()} == {
        *("phantom.toml", "phantom.ply", "phantom.png", "region_tumour.ply")
    }
    surface = read_surface(output / "phantom.ply", "m")
    assert any("cavity" in repair for repair in surface.repairs)
    assert surface.surface.bounds.mean(axis=0) == pytest.approx([0, 0, 0], abs=1e-9)
    stated = tomllib.loads((output / "phantom.toml").read_text())
    assert stated["phantom"]["region"][0]["modulus_ratio"] == 2.5
    assert len(stated["fiducials"]["rest"]) == 5
    # the tumour lies along +j of the grid's first axis, which is +y in LPS
    assert read_surface(output / "region_tumour.ply", "m").surface.vertices[:, 1].mean() > 0.005


def test_a_phantom_is_held_once_its_file_says_where(
    segmentation: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "P07"
    told(
        ["phantom", segmentation, "--label", ORGAN, "--cavity", CYST, "--centred", "--output", output], capsys
    )
    message = refused(
        ["simulate", "--phantom", output / "phantom.toml", "--output", tmp_path / "case"], capsys
    )
    assert "states no [[anchor]]; add where the phantom is held" in message
    with (output / "phantom.toml").open("a") as file:
        file.write(
            "\n[[anchor]]\nbox = [[-1, -1, -1], [-0.01, 1, 1]]\n\n[grasp]\nbox = [[0.01, 0, 0], [1, 1, 1]]\n"
        )
    assert read_mounted_phantom(output / "phantom.toml").anchors[0].upper == (-0.01, 1.0, 1.0)


def test_the_image_frame_is_lps_or_ras(
    segmentation: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bounds = {}
    for frame in ("LPS", "RAS"):
        options = ["--label", ORGAN, "--region", "a=3:modulus_ratio=2", "--frame", frame, "--fill-holes"]
        found = told(["phantom", segmentation, *options, "--output", tmp_path / frame], capsys)
        assert found["frame"] == f"the image's frame ({frame})"
        bounds[frame] = read_surface(tmp_path / frame / "phantom.ply", "m").surface.bounds
    # voxel (20, 18, 12) of the centre
    assert bounds["LPS"].mean(axis=0) == pytest.approx([12e-3 - 36e-3, -30e-3 + 40e-3, 81e-3], abs=1e-3)
    assert bounds["RAS"] == pytest.approx(ras(bounds["LPS"]))


def ras(lps: np.ndarray) -> np.ndarray:
    turned = lps * (-1, -1, 1)
    return np.array([turned.min(axis=0), turned.max(axis=0)])


def test_fiducials_bring_it_to_the_tissue_frame(
    segmentation: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    image = np.array([[0, 0, 80], [-40, 10, 80], [-20, 40, 85], [-20, 0, 95.0]])
    tissue = image[:, [1, 2, 0]] + (5, -80, 25)  # a cyclic exchange of axes is a turn
    rows = [",".join(map(str, row)) for row in np.hstack([image, tissue]).tolist()]
    header = "image_x_mm,image_y_mm,image_z_mm,tissue_x_mm,tissue_y_mm,tissue_z_mm"
    (tmp_path / "pairs.csv").write_text("\n".join([header, *rows]) + "\n")
    options = ["--label", ORGAN, "--fill-holes", "--largest", "--fiducials", tmp_path / "pairs.csv"]
    found = told(["phantom", segmentation, *options, "--output", tmp_path / "P07"], capsys)
    assert found["registration"]["rms_m"] == pytest.approx(0.0, abs=1e-9)  # type: ignore[index]
    middle = read_surface(tmp_path / "P07" / "phantom.ply", "m").surface.bounds.mean(axis=0)
    assert middle == pytest.approx(1e-3 * (np.array([15, 1, 1])), abs=1e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--label", "9"], "has no voxel of label 9; it holds 1, 2, 3"),
        (["--label", "liver"], "has no voxel of label liver; it holds 1, 2, 3"),
        ([], "which label is the organ? There are 1, 2, 3; name it with --label"),
        (["--label", "1", "--region", "a=3"], "--region a=3: write it as NAME=LABEL:modulus_ratio=R"),
        (["--label", "1", "--region", "../a=3:modulus_ratio=2"], "write it as NAME=LABEL:modulus_ratio=R"),
        (["--label", "1", "--centred", "--onto", "a.ply"], "--centred: the registration tells where"),
        (["--label", "1", "--fiducials", "nothing.csv"], "nothing.csv: there is no such file"),
    ],
)
def test_what_cannot_be_is_one_line(
    segmentation: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], message: str
) -> None:
    output = tmp_path / "P07"
    assert message in refused(["phantom", segmentation, *options, "--output", output], capsys)
    assert list(tmp_path.iterdir()) == []


def test_dicom_without_its_extra_says_what_to_install(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from tests.estimator.dicom_seg_files import write_dicom_seg

    write_dicom_seg({"liver": np.ones((3, 3, 3), dtype=bool)}, np.eye(4), tmp_path / "a.dcm")
    monkeypatch.setitem(sys.modules, "highdicom", None)
    message = refused(["phantom", tmp_path / "a.dcm", "--output", tmp_path / "out"], capsys)
    assert 'install it with: pip install "retraction[dicom]"' in message


def test_a_mesh_is_converted_and_its_surface_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    points = 0.1 * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
    cells = [("tetra", np.array([[0, 1, 3, 2], [1, 2, 3, 4]]))]
    meshio.Mesh(points, cells, cell_data={"tumour": [np.array([0, 1], np.uint8)]}).write(tmp_path / "a.vtu")
    out, surface = tmp_path / "b.inp", tmp_path / "b.ply"
    found = told(["mesh", tmp_path / "a.vtu", "-o", out, "--surface", surface], capsys)
    assert found["elements"] == {"tet4": 2}
    assert found["regions"] == {"tumour": 1}
    assert found["repairs"] == ["turned 1 tet4, which were inside out"]
    assert found["files"] == [str(out), str(surface), str(tmp_path / "b_tumour.ply")]
    assert read_surface(surface, "m").surface.volume_m3 == pytest.approx(float(str(found["volume_m3"])))
    message = refused(["mesh", tmp_path / "a.vtu", "-o", out, "--strict"], capsys)
    assert "turned 1 tet4, which were inside out; mend it where it was made" in message
    assert "give a name that ends with" in refused(["mesh", out, "-o", tmp_path / "b.xyz"], capsys)


def test_a_segmented_phantom_with_a_tumour_is_simulated_in_a_painted_grasp(
    segmentation: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RETRACT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("daq.cli.estimation.simulate.simulate_case", partial(simulate_case, resolution=TINY))
    options = [
        "--label",
        ORGAN,
        "--cavity",
        CYST,
        "--region",
        "tumour=3:modulus_ratio=4",
        "--centred",
        "--beads",
        3,
    ]
    told(["phantom", segmentation, *options, "--output", tmp_path / "P07"], capsys)
    surface = read_surface(tmp_path / "P07" / "phantom.ply", "m").surface
    held = (surface.vertices[:, 1] > 0.02).astype(np.uint8)
    painted = meshio.Mesh(surface.vertices, [("triangle", surface.triangles)], point_data={"held": held})
    painted.write(tmp_path / "P07" / "painted.vtu")
    with (tmp_path / "P07" / "phantom.toml").open("a") as file:
        file.write("\n[[anchor]]\nbox = [[-0.1, -0.1, -0.1], [0.1, -0.02, 0.1]]\n")
        file.write('\n[grasp]\npainted = "painted.vtu"\nscalar = "held"\ncentre = [0.0, 0.025, 0.0]\n')
    (tmp_path / "mine.csv").write_text("x_m,y_m,z_m,rz_rad,phase\n0,0.002,0,0,hold\n")
    arguments = ["--trajectory", tmp_path / "mine.csv", "--force-std", 1e-4, "--torque-std", 1e-5]
    case = tmp_path / "case"
    told(["simulate", "--phantom", tmp_path / "P07" / "phantom.toml", *arguments, "--output", case], capsys)
    (pulled,) = read_case(case)
    assert pulled.wrench[-1, 1] < -0.1
    assert isinstance(pulled.grasp.box, PaintedPatch)
    assert [(one.name, one.modulus_ratio) for one in pulled.phantom.regions] == [("tumour", 4.0)]
