"""From the image's frame to the tissue's."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.geometry.organ import organ_surface
from estimator.segmentation.phantom import moved
from estimator.segmentation.points import read_fiducials, read_points
from estimator.segmentation.registration import registered_by_fiducials, registered_by_surface
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]


def motion(seed: int = 1, angle: float = 2.0) -> FloatArray:
    random = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(angle * random.dirichlet([1, 1, 1])).as_matrix()
    T[:3, 3] = random.uniform(-0.3, 0.3, 3)
    return T


def applied(T: FloatArray, points: FloatArray) -> FloatArray:
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])


@pytest.fixture(scope="module")
def organ() -> Surface:
    return organ_surface(3, subdivisions=3)


@pytest.mark.parametrize("seed", range(5))
def test_fiducials_give_the_motion_back(seed: int) -> None:
    image, T = np.random.default_rng(seed).uniform(-0.1, 0.1, (6, 3)), motion(seed)
    found = registered_by_fiducials(image, applied(T, image), "pairs.csv")
    assert found.T_tissue_image == pytest.approx(T, abs=1e-12)
    assert found.rms_m < 1e-12
    assert found.remarks == ()


def test_the_error_of_fiducials_is_that_of_their_noise() -> None:
    random = np.random.default_rng(0)
    image, T = random.uniform(-0.1, 0.1, (12, 3)), motion()
    found = registered_by_fiducials(image, applied(T, image) + random.normal(0, 1e-3, (12, 3)), "pairs.csv")
    assert found.rms_m == pytest.approx(1e-3 * np.sqrt(3), rel=0.3)
    assert np.sqrt(np.mean(found.left_out_m**2)) > found.rms_m


def test_a_fiducial_that_was_mistaken_stands_out() -> None:
    image, T = np.random.default_rng(3).uniform(-0.1, 0.1, (7, 3)), motion()
    tissue = applied(T, image)
    tissue[4] += (0, 0.02, 0)
    assert np.argmax(registered_by_fiducials(image, tissue, "pairs.csv").left_out_m) == 4


def test_a_mirrored_frame_is_told_and_not_followed() -> None:
    image, T = np.random.default_rng(3).uniform(-0.1, 0.1, (7, 3)), motion()
    found = registered_by_fiducials(image, applied(T, image * (1, -1, 1)), "pairs.csv")
    assert np.linalg.det(found.T_tissue_image[:3, :3]) == pytest.approx(1.0)
    assert found.remarks[0].startswith("mirrored, the points would fit far better")


@pytest.mark.parametrize(
    ("image", "told"),
    [
        (np.eye(3)[:2], "2 pairs of points; a registration takes three or more"),
        (np.outer(np.arange(5.0), [1, 2, 3]), "the points of the image lie on a line"),
    ],
)
def test_too_few_fiducials_are_refused(image: FloatArray, told: str) -> None:
    with pytest.raises(InputError, match=f"pairs.csv: {told}"):
        registered_by_fiducials(image, image, "pairs.csv")


@pytest.mark.parametrize("seed", [1, 2])
def test_a_surface_is_laid_onto_a_scan_of_it(organ: Surface, seed: int) -> None:
    T, random = motion(seed), np.random.default_rng(seed)
    scan = moved(organ, T).vertices
    scan = scan + random.normal(0, 2e-4, scan.shape)
    found = registered_by_surface(organ, scan)
    assert found.remarks == ()
    assert found.T_tissue_image == pytest.approx(T, abs=2e-3)
    assert found.rms_m == pytest.approx(2e-4, rel=0.3)


def test_a_scan_of_the_upper_side_does_where_fiducials_begin(organ: Surface) -> None:
    T = motion(4, 1.0)
    upper = organ.vertices[organ.vertices[:, 2] > 0]
    near = motion(4, 1.0)
    near[:3, 3] += 0.004
    found = registered_by_surface(organ, applied(T, upper), near)
    assert found.T_tissue_image == pytest.approx(T, abs=1e-3)


def test_tables_of_points_are_in_millimetres(tmp_path: Path) -> None:
    file = tmp_path / "pairs.csv"
    file.write_text(
        "name,image_x_mm,image_y_mm,image_z_mm,tissue_x_mm,tissue_y_mm,tissue_z_mm\na,1,2,3,4,5,6\nb,0,0,1,0,0,2\n"
    )
    image, tissue = read_fiducials(file)
    assert image == pytest.approx(np.array([[1e-3, 2e-3, 3e-3], [0, 0, 1e-3]]))
    assert tissue == pytest.approx(np.array([[4e-3, 5e-3, 6e-3], [0, 0, 2e-3]]))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x,y,z\n1,2,3\n", "has no column x_mm"),
        ("x_mm,y_mm,z_mm\n1,2,three\n", "row 1 .from 1.: 'three' is no decimal number"),
        ("x_mm,y_mm,z_mm\n1,2,nan\n", "row 1 .from 1.: 'nan' is no finite number"),
        ("", "has no column x_mm"),
    ],
)
def test_a_table_that_is_no_table_of_points_is_refused(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "points.csv").write_text(text)
    with pytest.raises(InputError, match=told):
        read_points(tmp_path / "points.csv")
