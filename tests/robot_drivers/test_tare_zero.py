"""Zeroing by arithmetic: what a tare tells, when it is refused, and how it is undone."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student_t

from robot_drivers.ati.compensation.tare import TareConditions, TareRefusedError, TareStack, take_tare
from robot_drivers.ati.transducer.gamma import GAGE_NOISE_STD
from robot_drivers.errors import ConfigurationError
from robot_drivers.protocols import WrenchBlock

LOAD = np.array([1.0, -2.0, 3.0, 0.1, -0.2, 0.3])
NOISE = np.array(GAGE_NOISE_STD)


def block(wrench, rate_hz=1000.0):
    """Samples at a steady rate, all usable."""
    n = len(wrench)
    counter = np.arange(n)
    return WrenchBlock(
        counter=counter,
        device_time_s=5.0 + counter / rate_hz,
        host_time_ns=10**9 + np.rint(counter * 1e9 / rate_hz).astype(np.int64),
        status=np.zeros(n, np.int64),
        usable=np.ones(n, np.bool_),
        wrench=np.asarray(wrench, np.float64),
    )


def at_rest(n=1000, seed=0, slope=(0.0,) * 6):
    random = np.random.default_rng(seed)
    time_s = np.arange(n)[:, np.newaxis] / 1000.0
    return LOAD + random.standard_normal((n, 6)) * NOISE + (time_s - time_s.mean()) * slope


def test_a_tare_is_the_mean_and_says_how_sure_it_is():
    tare = take_tare(block(at_rest()))
    np.testing.assert_allclose(tare.offset, LOAD, atol=5 * NOISE.max() / 30)
    np.testing.assert_allclose(tare.noise_std, NOISE, rtol=0.1)
    assert (tare.duration_s, tare.samples) == (1.0, 1000)
    assert tare.host_time_ns == pytest.approx(1.5e9, abs=2e6)
    np.testing.assert_allclose(tare.apply(np.array([LOAD])), 0, atol=0.002)


def test_the_stated_errors_are_those_that_occur():
    tares = [take_tare(block(at_rest(400, seed))) for seed in range(300)]
    for errors, freedom in [
        ([(tare.offset - LOAD) / tare.offset_std for tare in tares], 9),
        ([tare.drift_per_s / tare.drift_std for tare in tares], 8),
    ]:
        within = np.abs(errors) < student_t.ppf(0.975, freedom)
        assert within.mean() == pytest.approx(0.95, abs=0.016)  # three standard deviations of 1800 draws


def test_slow_noise_widens_the_stated_error():
    white = at_rest(2000)
    slow = white + 0.01 * np.sin(np.arange(2000) / 120)[:, np.newaxis] * [1, 0, 0, 0, 0, 0]
    assert take_tare(block(slow)).offset_std[0] > 3 * take_tare(block(white)).offset_std[0]


def test_a_small_drift_is_stated_with_its_error():
    slope = np.array([0.02, 0, 0, 0, 0, 0.001])
    tare = take_tare(block(at_rest(2000, slope=slope)))
    assert (np.abs(tare.drift_per_s - slope) < 5 * tare.drift_std).all()
    assert tare.drift_per_s[0] > 5 * tare.drift_std[0]
    assert "drift +0.0" in tare.statement().splitlines()[1]
    assert tare.statement().splitlines()[1].startswith("Fx +1.0")


@pytest.mark.parametrize(
    ("motion", "channel"),
    [
        (lambda t: np.outer(t, [0.5, 0, 0, 0, 0, 0]), "Fx"),
        (lambda t: np.outer(np.where(t > 0.3, 0.3, 0), [0, 0, 1, 0, 0, 0]), "Fz"),
        (lambda t: np.outer(np.sin(2 * np.pi * 2 * t), [0, 0, 0, 0, 0.02, 0]), "Ty"),
    ],
    ids=["ramp", "step", "sway"],
)
def test_a_load_that_moves_is_refused_with_the_channel(motion, channel):
    moving = at_rest() + motion(np.arange(1000) / 1000)
    with pytest.raises(TareRefusedError, match=f"not at rest: {channel} wanders"):
        take_tare(block(moving))


def test_pick_up_from_the_mains_is_no_motion():
    hum = 0.2 * np.sin(2 * np.pi * 50 * np.arange(1000) / 1000)
    tare = take_tare(block(at_rest() + hum[:, np.newaxis]))
    np.testing.assert_allclose(tare.offset, LOAD, atol=0.002)


def test_a_sensor_at_rest_is_not_refused_for_its_noise():
    coarse = TareConditions(wander=tuple(1e-6 * NOISE))
    for seed in range(200):
        take_tare(block(at_rest(300, seed)), coarse)


def test_samples_that_are_not_usable_are_refused():
    usable = np.ones(1000, np.bool_)
    usable[[3, 500]] = False
    with pytest.raises(TareRefusedError, match="2 of 1000 samples are not usable"):
        take_tare(replace(block(at_rest()), usable=usable))


def test_missing_samples_are_refused():
    counter = np.arange(1000)
    counter[400:] += 7
    with pytest.raises(TareRefusedError, match="missing in 1 place"):
        take_tare(replace(block(at_rest()), counter=counter))


def test_too_little_is_refused():
    with pytest.raises(TareRefusedError, match="10 samples are too few"):
        take_tare(block(at_rest(10)))
    with pytest.raises(TareRefusedError, match="too short"):
        take_tare(block(at_rest(100)))
    take_tare(block(at_rest(200)))


def test_conditions_that_cannot_be_are_refused():
    for wrong in ({"wander": (0.1,) * 5}, {"wander": (0.0,) * 6}, {"duration_s": 0.0}, {"samples": 10}):
        with pytest.raises(ConfigurationError, match="tare conditions"):
            TareConditions(**wrong)


def test_the_last_tare_is_in_force_until_it_is_undone():
    first, second = take_tare(block(at_rest())), take_tare(block(at_rest() + 1.0))
    readings = np.array([LOAD, LOAD + 2.0])
    stack = TareStack()
    np.testing.assert_array_equal(stack.apply(readings), readings)
    stack = stack.push(first).push(second)
    np.testing.assert_array_equal(stack.apply(readings), readings - second.offset)
    stack = stack.undo()
    np.testing.assert_array_equal(stack.apply(readings), readings - first.offset)
    np.testing.assert_array_equal(stack.undo().apply(readings), readings)
    with pytest.raises(TareRefusedError, match="no tare to undo"):
        TareStack().undo()
