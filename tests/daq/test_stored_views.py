"""Stored views of a board, in whatever depth a camera's program saved them."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from daq.calibration.stored_views import single_views

GREY = np.linspace(0, 255, 48 * 64).round().astype(np.uint8).reshape(48, 64)


@pytest.mark.parametrize("bits", [10, 12, 14, 16])
@pytest.mark.parametrize("upper", [False, True], ids=["lower bits", "upper bits"])
def test_images_of_more_than_eight_bits_keep_their_contrast(bits: int, upper: bool, tmp_path: Path) -> None:
    deep = np.round(GREY / 255.0 * (2**bits - 1)).astype(np.uint16) << (16 - bits if upper else 0)
    assert cv2.imwrite(str(tmp_path / "view.png"), deep)
    ((_, found),) = single_views(tmp_path)
    assert found.dtype == np.uint8
    assert found == pytest.approx(GREY, abs=1)


def test_images_of_eight_bits_stay_as_they_are(tmp_path: Path) -> None:
    dim = GREY // 4
    assert cv2.imwrite(str(tmp_path / "view.png"), dim)
    ((_, found),) = single_views(tmp_path)
    assert np.array_equal(found, dim)
