"""The beads at rest against the design: orientation, missing beads, and wrong names."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from daq.vision.errors import VisionError
from daq.vision.identity import IdentitySettings, IdentityTracker
from daq.vision.rest_grid import match_grid, mislabelled

FloatArray = NDArray[np.float64]

GRID = np.stack(np.meshgrid([-0.03, -0.01, 0.01, 0.03], [-0.03, -0.01, 0.01, 0.03]), axis=-1).reshape(-1, 2)
DESIGN = np.column_stack([GRID, np.full(16, 0.005)])
# one bead moved out of the grid tells the orientation
MARKED = DESIGN.copy()
MARKED[3] += (0.006, -0.006, 0.0)


def laid(design: FloatArray, turn_deg: float, seed: int) -> FloatArray:
    """The design turned about z, moved by 5 mm, and every bead off by 0.7 mm."""
    rng = np.random.default_rng(seed)
    turned = Rotation.from_euler("z", turn_deg, degrees=True).apply(design)
    return turned + np.array([0.004, -0.003, 0.001]) + rng.normal(0.0, 7e-4, design.shape)


@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 180.0, -90.0, 37.0])
def test_a_marked_design_tells_its_orientation(turn_deg: float) -> None:
    order = np.random.default_rng(1).permutation(16)
    found = match_grid(MARKED, laid(MARKED, turn_deg, 2)[order])
    assert found.turn_deg == pytest.approx(turn_deg, abs=2.5) or abs(found.turn_deg) > 177
    np.testing.assert_array_equal(order[found.points], np.arange(16))
    assert found.rivals_deg == ()
    assert found.rms_m < 1.5e-3


def test_a_square_grid_takes_the_expected_orientation_and_tells_its_rivals() -> None:
    for expected in (0.0, 90.0):
        found = match_grid(DESIGN, laid(DESIGN, 0.0, 3), expected_deg=expected)
        assert found.turn_deg == pytest.approx(expected, abs=2.5)
        assert len(found.rivals_deg) == 3
    assert "fit as well" in found.describe()


def test_missing_beads_and_dirt_are_left_out() -> None:
    beads = laid(MARKED, 0.0, 4)
    with_dirt = np.vstack([np.delete(beads, [2, 9], axis=0), [[0.08, 0.08, 0.005]]])
    found = match_grid(MARKED, with_dirt)
    assert found.found == 14
    assert found.points[2] == found.points[9] == -1
    kept = np.delete(np.arange(16), [2, 9])
    np.testing.assert_array_equal(found.points[kept], np.arange(14))


def test_exchanged_names_are_found() -> None:
    named = laid(DESIGN, 0.0, 5)
    assert mislabelled(DESIGN, named) == {}
    named[[5, 6]] = named[[6, 5]]
    named[12] = np.nan
    assert mislabelled(DESIGN, named) == {5: 6, 6: 5}


def test_a_design_that_is_mounted_turned_is_told_when_nothing_can_be_named() -> None:
    oblong = DESIGN * (1.0, 0.6, 1.0)
    turned = Rotation.from_euler("z", 90, degrees=True).apply(oblong)
    with pytest.raises(VisionError, match=r"16 of 16 beads fit the design turned by (-90|90)\.0°"):
        IdentityTracker(oblong, IdentitySettings()).assign(turned, 0.0)


def test_three_beads_do_not_tell_how_a_grid_lies() -> None:
    with pytest.raises(VisionError, match="3 beads for 16 fiducials"):
        match_grid(DESIGN, DESIGN[:3])
