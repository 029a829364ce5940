"""How large a gap may be that does not show: never told too small, nor much too large."""

import numpy as np
import pytest
from bare_contexts import bare_case
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK

from estimator.diagnosis.conclusions.gap import largest_gaps
from estimator.diagnosis.fitting.case import Case
from estimator.inference.whitening import Whitening, inverse_root, shrunk

FloatArray = NDArray[np.float64]


def small_gap_case(gap: float, shared: float, rng: np.random.Generator) -> tuple[Case, list[FloatArray]]:
    """A case of 80 rows and six beads, a misfit of noise and of a gap of all beads, in units of their noise."""
    rows, channels = 80, 6 + 3 * 6
    deviation = np.concatenate([np.full(3, 0.02), np.full(3, 5e-4), np.full(channels - 6, 5e-5)])
    aside = np.zeros((rows, channels))
    aside[:, 6:] = shared
    seen = np.ones((rows, channels), dtype=bool)
    whitening = Whitening(seen, deviation, np.zeros(channels), *inverse_root(aside.reshape(-1, 1)))
    # What rows have in common whitens to noise; only what is beyond stays.
    misfit = rng.normal(size=(rows, channels)) + gap * np.sign(rng.normal(size=channels)) * (
        np.arange(channels) >= 6
    )
    residual = shrunk(misfit.reshape(-1, 1), whitening.vectors, whitening.shrink)[:, 0]
    return bare_case([REFERENCE_BLOCK], [whitening]), [residual]


@pytest.mark.parametrize("gap", [0.0, 0.3, 1.0])
def test_a_gap_is_told_to_be_no_larger_than_it_may_be_and_no_smaller_than_it_is(gap: float) -> None:
    case, residual = small_gap_case(gap, 0.0, np.random.default_rng(11))
    found = largest_gaps(case, residual, 1.0)
    assert gap * 5e-5 < found["fiducials"].value < (gap + 0.5) * 5e-5
    assert found["force"].value < 0.6 * 0.02
    assert [quantity.unit for quantity in found.values()] == ["N", "N·m", "m"]


def test_what_the_model_may_be_off_by_is_never_told_to_be_excluded() -> None:
    case, residual = small_gap_case(0.0, 2.0, np.random.default_rng(12))
    assert largest_gaps(case, residual, 1.0)["fiducials"].value > 2.0 * 5e-5
