"""Bench tests written from textbook formulas, apart from the forward model of the diagnosis."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from estimator.uniaxial.diagnosis import BenchMode, BenchTest

FloatArray = NDArray[np.float64]
MODULUS = 30e3  # Pa
RATE = 0.01  # 1/s


def cycles(reach: float = 0.4, count: int = 3, rows: int = 100) -> FloatArray:
    """Strain of cycles, each larger than the one before."""
    ways = []
    for number in range(1, count + 1):
        top = reach * number / count
        ways += [np.linspace(0, top, rows, endpoint=False), np.linspace(top, 0, rows, endpoint=False)]
    return np.concatenate(ways)


def times(strain: FloatArray, rate: float = RATE) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(strain)))]) / rate


def neo_hookean(strain: FloatArray, sign: float = 1.0) -> FloatArray:
    """Magnitude of stress at magnitudes of strain; the sign is -1 in compression."""
    stretch = 1 + sign * strain
    return np.asarray(sign * MODULUS / 3 * (stretch - stretch**-2))


def fung(strain: FloatArray, exponent: float = 1.0) -> FloatArray:
    """W = μ/2b (exp(b (I1 - 3)) - 1)."""
    stretch = 1 + strain
    return neo_hookean(strain) * np.exp(exponent * (stretch**2 + 2 / stretch - 3))


def maxwell(strain: FloatArray, share: float = 0.6, time: float = 8.0) -> FloatArray:
    """A spring beside a Maxwell element, as the differential equation q' = P' - q/τ."""
    at, elastic = times(strain), neo_hookean(strain)

    def rate(t: float, q: FloatArray) -> FloatArray:
        place = min(int(np.searchsorted(at, t, side="right")), len(at) - 1)
        slope = (elastic[place] - elastic[place - 1]) / (at[place] - at[place - 1])
        return np.asarray(slope - q / time)

    branch = solve_ivp(rate, (0, at[-1]), [0.0], t_eval=at, max_step=0.5).y[0]
    return np.maximum(elastic + share * branch, 0.0)


def stretched_exponential(strain: FloatArray) -> FloatArray:
    """Kohlrausch, Williams and Watts: G(t) = 1 + 0.8 exp(-(t/10)^0.5)."""
    at, steps = times(strain), np.diff(neo_hookean(strain), prepend=0.0)
    lag = np.maximum(at[:, None] - at, 0.0)
    modulus = np.tril(1 + 0.8 * np.exp(-np.sqrt(lag / 10)))
    return np.asarray(np.maximum(modulus @ steps, 0.0))


def ogden_roxburgh(strain: FloatArray) -> FloatArray:
    energy = _energy(strain)
    largest = np.maximum.accumulate(energy)
    lost = [0.4 * math.erf(one) for one in (largest - energy) / (0.2 * energy.max())]
    return np.asarray(neo_hookean(strain) * (1 - np.array(lost)))


def exponential_softening(strain: FloatArray) -> FloatArray:
    """Damage that saturates with the largest energy so far, away from it: 1 - 0.4 (1 - exp(-(Wm - W)/w))."""
    energy = _energy(strain)
    away = np.maximum.accumulate(energy) - energy
    return np.asarray(neo_hookean(strain) * (1 - 0.4 * (1 - np.exp(-away / (0.15 * energy.max())))))


def with_slack(strain: FloatArray) -> FloatArray:
    return neo_hookean(np.maximum(strain - 0.04, 0.0))


def with_set(strain: FloatArray) -> FloatArray:
    return neo_hookean(np.maximum(strain - 0.1 * np.maximum.accumulate(strain), 0.0))


def with_soft_machine(strain: FloatArray) -> FloatArray:
    own = np.linspace(0.0, 1.0, 5000)
    return np.asarray(np.interp(strain, own + 0.3 * neo_hookean(own) / MODULUS, neo_hookean(own)))


def with_slip(strain: FloatArray) -> FloatArray:
    slipped = 0.3 * np.maximum(np.maximum.accumulate(strain) - 0.2, 0.0)
    return neo_hookean(np.maximum(strain - slipped, 0.0))


def with_friction(strain: FloatArray) -> FloatArray:
    """Compression of a cylinder as high as it is wide, on platens with a coefficient of 0.3, as Siebel has it."""
    coming = np.gradient(strain) >= 0
    ratio = (1 - strain) ** -1.5
    return np.asarray(neo_hookean(strain, -1.0) * (1 + np.where(coming, 1, -1) * 0.3 * ratio / 3))


def bench_test(
    strain: FloatArray, stress: FloatArray, noise: float, seed: int, mode: BenchMode = "tension"
) -> BenchTest:
    """A test with white noise of a share of the largest stress."""
    added = noise * float(np.abs(stress).max()) * np.random.default_rng(seed).normal(size=len(stress))
    return BenchTest("made", mode, strain, stress + added, times(strain))


def _energy(strain: FloatArray) -> FloatArray:
    stretch = 1 + strain
    return np.asarray(MODULUS / 6 * (stretch**2 + 2 / stretch - 3))
