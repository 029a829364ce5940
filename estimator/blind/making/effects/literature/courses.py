"""How an error of an instrument comes and goes: with time, temperature, load, from experiment to experiment."""

from collections.abc import Callable

import numpy as np

from estimator.blind.making.effects.drawing import FloatArray, Random, drawn_between
from estimator.blind.making.scenes.scene import Readings

# Of readings with n rows, a factor (n,) on an error.
Course = Callable[[Readings], FloatArray]

# An experiment and the pause after it take about two minutes.
BETWEEN_S = 120.0


def by_order(random: Random) -> Course:
    """Set anew before each experiment."""
    factors = random.uniform(-1.0, 1.0, 3)
    factors[int(random.integers(3))] = 1.0
    return lambda reading: np.full(len(reading.rows.time), factors[reading.rows.order - 1])


def random_walk(random: Random) -> Course:
    """A walk that has gone one unit, on average, after a minute, from the first row of each experiment on."""
    seed = int(random.integers(2**31))

    def course(reading: Readings) -> FloatArray:
        own = np.random.default_rng([seed, reading.rows.order])
        steps = np.sqrt(np.diff(reading.rows.time, prepend=reading.rows.time[0]) / 60)
        return np.cumsum(steps * own.standard_normal(len(steps)))

    return course


def root_of_time(random: Random) -> Course:
    """√(t/min): heat that soaks in."""
    return lambda reading: np.sqrt(reading.rows.time / 60)


def periodic(random: Random) -> Course:
    """The cycle of an air conditioning, less what it was at the first row."""
    period, phase = drawn_between(random, 40.0, 150.0), float(random.uniform(0, 2 * np.pi))

    def course(reading: Readings) -> FloatArray:
        at = 2 * np.pi * (reading.rows.time + BETWEEN_S * (reading.rows.order - 1)) / period + phase
        return np.sin(at) - np.sin(at[0])

    return course


def growing(random: Random) -> Course:
    """One after a minute of each experiment."""
    return lambda reading: reading.rows.time / 60


def running_on(random: Random) -> Course:
    """One after the first experiment, and ever more."""
    return lambda reading: reading.rows.time / BETWEEN_S + reading.rows.order - 1


def later(random: Random) -> Course:
    """None, and one from an experiment after the first on: something was knocked."""
    first = int(random.integers(2, 4))
    return lambda reading: np.full(len(reading.rows.time), float(reading.rows.order >= first))


def stepwise(random: Random) -> Course:
    """None, and one from an instant within each experiment on."""
    share = float(random.uniform(0.2, 0.7))
    return lambda reading: (reading.rows.time > share * reading.rows.time[-1]).astype(np.float64)
