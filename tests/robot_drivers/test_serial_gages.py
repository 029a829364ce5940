"""From gages to wrenches, with the calibration of a real Gamma."""

from dataclasses import replace

import numpy as np
import pytest

from robot_drivers.ati.transducer.gages import (
    FT33206,
    GAGES_ON_WIRE,
    GageCalibration,
    from_wire_order,
    saturated,
)
from robot_drivers.ati.transducer.scaling import Scaling
from robot_drivers.errors import DeviceProtocolError

# gage counts at one full rated load, computed once from the certificate's matrix
RATED_LOADS = [
    ((130, 0, 0, 0, 0, 0), (4146, 6, -2018, -15295, -2177, 15351)),
    ((0, 130, 0, 0, 0, 0), (-243, 17650, 3575, -8838, -3514, -8851)),
    ((0, 0, 400, 0, 0, 0), (17546, 95, 17545, -360, 17478, 54)),
    ((0, 0, 0, 10, 0, 0), (96, 60, -22705, 447, 22759, 51)),
    ((0, 0, 0, 0, 10, 0), (26379, 83, -13052, 208, -13137, -87)),
    ((0, 0, 0, 0, 0, 10), (352, -24873, 62, -24918, 211, -25021)),
]


@pytest.mark.parametrize(("wrench", "gages"), RATED_LOADS)
def test_a_rated_load_moves_the_gages_as_computed_from_the_certificate(wrench, gages):
    np.testing.assert_allclose(FT33206.gages(wrench), gages, atol=0.6)
    # 0.5 count on every gage is some 10 mN and 0.3 mN·m
    np.testing.assert_allclose(FT33206.wrench(np.array(gages)), wrench, atol=0.02)


def test_one_count_is_the_coefficient_of_the_certificate():
    counts = np.eye(6, dtype=np.int16)
    np.testing.assert_allclose(FT33206.wrench(counts)[2, 2], 7652.86e-6)
    np.testing.assert_allclose(FT33206.wrench(counts)[5], 1e-6 * FT33206.matrix[:, 5])


def test_gages_and_wrench_are_inverse():
    wrench = np.random.default_rng(1).normal(0, 1, (20, 6)) * FT33206.rated_wrench
    np.testing.assert_allclose(FT33206.wrench(FT33206.gages(wrench)), wrench, rtol=1e-9, atol=1e-9)


def test_the_bias_is_subtracted_from_the_gages_before_the_matrix():
    load = np.array([20.0, -30.0, 40.0, 1.0, -2.0, 3.0])
    bias = np.array([12000.0, -7000.0, 300.0, -15000.0, 9000.0, 40.0])
    gages = np.rint(FT33206.gages(load) + bias).astype(np.int16)
    np.testing.assert_allclose(FT33206.wrench(gages, bias), load, atol=0.02)


def test_subtracting_a_bias_does_not_overflow_sixteen_bits():
    gages = np.array([[-30000, 30000, 0, 0, 0, 0]], np.int16)
    bias = np.array([30000, -30000, 0, 0, 0, 0], np.int16)
    expected = FT33206.matrix @ [-60000, 60000, 0, 0, 0, 0] * 1e-6
    np.testing.assert_allclose(FT33206.wrench(gages, bias)[0], expected)


def test_the_order_on_the_wire_is_undone():
    on_wire = np.array([[10, 12, 14, 11, 13, 15]], np.int16)
    np.testing.assert_array_equal(from_wire_order(on_wire), [[10, 11, 12, 13, 14, 15]])
    np.testing.assert_array_equal(np.array([10, 11, 12, 13, 14, 15])[list(GAGES_ON_WIRE)], on_wire[0])
    assert from_wire_order(on_wire).dtype == np.int32


@pytest.mark.parametrize("end", [-32768, 32767])
@pytest.mark.parametrize("gage", range(6))
def test_a_gage_at_the_end_of_its_range_saturates_the_sample(end, gage):
    gages = np.zeros((3, 6), np.int16)
    gages[1, gage] = end
    gages[2, gage] = end - np.sign(end)
    np.testing.assert_array_equal(saturated(gages), [False, True, False])


def test_a_combined_load_can_saturate_gages_with_every_axis_in_range():
    combined = np.array([130.0, 0.0, 400.0, 0.0, 10.0, 0.0])
    assert FT33206.in_range(combined[np.newaxis]).all()
    assert FT33206.saturation_margin(combined) < 0
    single = [FT33206.saturation_margin(wrench) for wrench, _ in RATED_LOADS]
    assert min(single) == pytest.approx(1 - 26379 / 32767, abs=1e-3)


def test_a_bias_narrows_the_margin():
    load = np.array([0.0, 0.0, 400.0, 0.0, 0.0, 0.0])
    assert FT33206.saturation_margin(load, bias=[10000, 0, 0, 0, 0, 0]) == pytest.approx(
        1 - 27546 / 32767, abs=1e-3
    )


def test_the_range_of_every_axis_is_its_rating():
    wrench = np.vstack([np.diag(FT33206.rated_wrench), -1.01 * np.diag(FT33206.rated_wrench)])
    np.testing.assert_array_equal(FT33206.in_range(wrench), [True] * 6 + [False] * 6)


def test_other_units_and_counts_give_the_same_newtons():
    millinewton_metres = Scaling("kN", "N-mm", 1e9, 1e3)
    calibration = replace(FT33206, scaling=millinewton_metres)
    np.testing.assert_allclose(calibration.wrench(np.arange(6)), FT33206.wrench(np.arange(6)))


@pytest.mark.parametrize(
    ("matrix", "what"),
    [
        (np.zeros((6, 6)), "singular"),
        (np.full((6, 6), np.nan), "finite"),
        (np.eye(5), "6 x 6"),
    ],
)
def test_what_is_no_calibration_is_refused(matrix, what):
    with pytest.raises(DeviceProtocolError, match=what):
        GageCalibration(matrix=matrix, rated_wrench=(1.0,) * 6)


def test_ratings_must_be_positive():
    with pytest.raises(DeviceProtocolError, match="ratings"):
        replace(FT33206, rated_wrench=(1.0, 1.0, 0.0, 1.0, 1.0, 1.0))
