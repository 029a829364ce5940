import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.timing.pairing import pair_by_time

PERIOD_NS = 40_000_000
HALF = PERIOD_NS / 2
EXPOSURES = np.arange(100) * PERIOD_NS + 10**15


def test_images_of_cameras_that_expose_together_are_all_paired() -> None:
    pairing = pair_by_time(EXPOSURES, EXPOSURES + 125_000, HALF)
    assert pairing.index.tolist() == [[k, k] for k in range(100)]
    assert (pairing.unpaired_left, pairing.unpaired_right) == (0, 0)


def test_an_image_whose_partner_was_lost_is_counted_and_shifts_no_other_pair() -> None:
    kept = np.delete(np.arange(100), [10, 11, 57])
    pairing = pair_by_time(EXPOSURES, EXPOSURES[kept], HALF)
    assert (pairing.unpaired_left, pairing.unpaired_right) == (3, 0)
    assert all(left == kept[right] for left, right in pairing.index)


def test_losses_of_both_cameras_are_counted_for_each() -> None:
    pairing = pair_by_time(EXPOSURES[5:], np.delete(EXPOSURES, [50, 51]), HALF)
    assert (pairing.unpaired_left, pairing.unpaired_right) == (2, 5)


def test_cameras_that_do_not_expose_together_have_no_pairs_within_the_tolerance() -> None:
    pairing = pair_by_time(EXPOSURES, EXPOSURES + PERIOD_NS // 4, PERIOD_NS / 8)
    assert len(pairing.index) == 0
    assert (pairing.unpaired_left, pairing.unpaired_right) == (100, 100)


@pytest.mark.parametrize(("left", "right"), [([], [1, 2]), ([5], []), ([], [])])
def test_a_camera_without_images_has_no_pairs(left: list[int], right: list[int]) -> None:
    pairing = pair_by_time(np.array(left, np.int64), np.array(right, np.int64), HALF)
    assert pairing.index.shape == (0, 2)
    assert (pairing.unpaired_left, pairing.unpaired_right) == (len(left), len(right))


times = st.lists(st.integers(0, 1000), max_size=30)


@given(times, times, st.integers(1, 200))
def test_every_image_is_in_one_pair_at_most_and_else_counted(
    left: list[int], right: list[int], tolerance: int
) -> None:
    pairing = pair_by_time(np.array(left, np.int64), np.array(right, np.int64), tolerance)
    for column, images, unpaired in (
        (0, left, pairing.unpaired_left),
        (1, right, pairing.unpaired_right),
    ):
        used = pairing.index[:, column].tolist()
        assert len(set(used)) == len(used) == len(images) - unpaired
    assert all(abs(left[i] - right[j]) < tolerance for i, j in pairing.index.tolist())
