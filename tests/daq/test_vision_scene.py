"""The rendered images: where a bead appears, how much light it takes, what noise it has."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.virtual_rig.rendering.scene import Scene, SceneSettings, flea2_pair

# a part of the sensor suffices, and is rendered faster
CAMERA = replace(flea2_pair().left, width=320, height=240, principal_point=(162.0, 118.0))
QUIET = SceneSettings(texture=0.0, vignetting=0.0, shading=0.0, electrons_per_dn=1e12, read_noise=0.0)
BEAD = np.array([[0.0123, -0.0071, 0.005]])
HIDDEN = np.full((1, 3), np.nan)


def darkening(settings: SceneSettings, seeds: int = 16) -> NDArray[np.float64]:
    """Mean over exposures of what one bead takes away, DN; a little read noise dithers the rounding."""
    scene = Scene(CAMERA, replace(settings, read_noise=0.5), seed=3)
    images = np.mean([scene.render(BEAD, k).astype(float) for k in range(seeds)], axis=0)
    column, row = np.rint(CAMERA.project(BEAD[0])).astype(int)
    patch = images[row - 12 : row + 13, column - 12 : column + 13]
    return settings.white_level * settings.surface_reflectance - patch


def test_the_pair_is_two_flea2_with_8_mm_lenses_converging_at_0_4_m() -> None:
    pair = flea2_pair()
    assert (pair.left.width, pair.left.height) == (1288, 964)
    assert pair.left.focal_length[0] * 3.75e-6 == pytest.approx(8e-3)
    assert pair.baseline_m == pytest.approx(0.175)
    for camera in (pair.left, pair.right):
        assert np.linalg.norm(camera.centre) == pytest.approx(0.4)
        np.testing.assert_allclose(camera.project([0.0, 0.0, 0.0]), camera.principal_point)


@pytest.mark.parametrize("shape", ["disc", "sphere"])
def test_a_bead_appears_where_its_centre_projects(shape: str) -> None:
    # an evenly grey ball: seen without the light's direction, its outline is centred on its centre
    settings = replace(QUIET, bead_shape=shape, bead_reflectance=0.0)
    missing = darkening(settings)
    column, row = CAMERA.project(BEAD[0]) - np.rint(CAMERA.project(BEAD[0])) + 12
    rows, columns = np.indices(missing.shape)
    assert (missing * columns).sum() / missing.sum() == pytest.approx(column, abs=0.01)
    assert (missing * rows).sum() / missing.sum() == pytest.approx(row, abs=0.01)


def test_a_disc_covers_the_area_that_perspective_gives_it() -> None:
    settings = replace(QUIET, bead_reflectance=0.0)
    angles = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    outline = BEAD + settings.bead_diameter / 2 * np.column_stack(
        [np.cos(angles), np.sin(angles), 0.0 * angles]
    )
    x, y = CAMERA.project(outline).T
    area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    covered = darkening(settings).sum() / (settings.white_level * settings.surface_reflectance)
    assert covered == pytest.approx(area, rel=0.005)


def test_the_lens_blurs_the_edge_of_a_bead() -> None:
    sharp, blurred = (np.abs(np.diff(darkening(replace(QUIET, blur=blur))[12])).max() for blur in (0.4, 1.6))
    assert blurred < 0.6 * sharp


def test_the_noise_is_shot_and_read_noise() -> None:
    settings = replace(QUIET, electrons_per_dn=20.0, read_noise=2.0)
    scene = Scene(CAMERA, settings, seed=1)
    patch = scene.render(HIDDEN, 0)[80:160, 120:220].astype(float)
    level = settings.white_level * settings.surface_reflectance
    assert patch.mean() == pytest.approx(level, abs=0.2)
    assert patch.var() == pytest.approx(level / 20.0 + 4.0 + 1.0 / 12.0, rel=0.06)


def test_vignetting_darkens_the_corners() -> None:
    image = Scene(CAMERA, replace(QUIET, vignetting=0.3, table_reflectance=0.6), seed=1).render(HIDDEN, 0)
    assert image[:4, :4].mean() == pytest.approx(0.7 * image[110:130, 150:170].mean(), rel=0.05)


def test_a_highlight_brightens_a_glossy_bead() -> None:
    dull, glossy = (darkening(replace(QUIET, bead_shape="sphere", glare=glare)) for glare in (0.0, 0.5))
    assert (dull - glossy).max() > 40.0
    assert (dull - glossy)[11:14, 11:14].min() > 5.0


def test_a_colour_sensor_shows_its_mosaic() -> None:
    image = Scene(CAMERA, replace(QUIET, pixel_format="bayer_rggb8"), seed=1).render(HIDDEN, 0)
    red, green, blue = image[120, 160], image[120, 161], image[121, 161]
    assert red > green > blue
    assert image[121, 160] == green


def test_an_exposure_number_gives_the_same_image_again_and_another_one_other_noise() -> None:
    scene = Scene(CAMERA, SceneSettings(), seed=7)
    np.testing.assert_array_equal(scene.render(BEAD, 5), scene.render(BEAD, 5))
    assert np.any(scene.render(BEAD, 5) != scene.render(BEAD, 6))


def test_hidden_beads_and_beads_out_of_sight_are_left_out() -> None:
    scene = Scene(CAMERA, SceneSettings(), seed=7)
    elsewhere = np.array([[0.5, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(scene.render(HIDDEN, 1), scene.render(elsewhere, 1))
