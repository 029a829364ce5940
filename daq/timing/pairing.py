"""Which images of two cameras were exposed together, and how many have no partner."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_drivers.protocols import IntArray


@dataclass(frozen=True, slots=True)
class Pairing:
    """The images of two cameras, paired one to one.

    Attributes
    ----------
    index : (p, 2) int64, left and right image of each pair, in order of time
    unpaired_left, unpaired_right : images without a partner
    """

    index: IntArray
    unpaired_left: int
    unpaired_right: int


def pair_by_time(left_ns: IntArray, right_ns: IntArray, tolerance_ns: float) -> Pairing:
    """Pair images whose times (n,) and (m,) differ by less than the tolerance.

    Two images are a pair when each is the nearest to the other; of images that are equally near the earlier is taken.
    """
    left_order, right_order = np.argsort(left_ns, kind="stable"), np.argsort(right_ns, kind="stable")
    left, right = left_ns[left_order], right_ns[right_order]
    if not (len(left) and len(right)):
        return Pairing(np.empty((0, 2), np.int64), len(left), len(right))
    partner = _nearest(left, right)
    mutual = _nearest(right, left)[partner] == np.arange(len(left))
    together = mutual & (np.abs(right[partner] - left) < tolerance_ns)
    index = np.stack([left_order[together], right_order[partner[together]]], axis=1).astype(np.int64)
    return Pairing(index, len(left) - len(index), len(right) - len(index))


def _nearest(times_ns: IntArray, others_ns: IntArray) -> NDArray[np.intp]:
    """Return, for each time (n,), the place of the nearest of ``others_ns`` (m,); both ascend."""
    after = np.clip(np.searchsorted(others_ns, times_ns), 1, max(len(others_ns) - 1, 1))
    after = np.minimum(after, len(others_ns) - 1)
    before = np.maximum(after - 1, 0)
    earlier = np.abs(times_ns - others_ns[before]) <= np.abs(others_ns[after] - times_ns)
    return np.where(earlier, before, after)
