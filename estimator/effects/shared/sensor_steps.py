"""What an effect does to readings, as numbers that a wrapper of any simulator's observations can apply.

An effect whose ``readings`` can be said so declares ``sensor_steps``. Each step is a JSON object with a ``kind`` that
:mod:`estimator.handover.observations` knows, and its numbers in SI units.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from estimator.effects.effect import Effect, Values
from estimator.effects.shared.axes import Frame
from estimator.experiment import Experiment

SensorStep = Mapping[str, Any]
Axes = Literal["gripper", "tissue"]


@runtime_checkable
class ToldInSteps(Protocol):
    """An effect that tells what it does to readings in steps."""

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the steps in their order; none where nothing changes."""


def sensor_steps_of(effect: Effect, experiment: Experiment, values: Values) -> tuple[SensorStep, ...] | None:
    """Return what an effect does to readings in steps; None where it has not been told so."""
    if isinstance(effect, ToldInSteps):
        return effect.sensor_steps(experiment, values)
    return None if "readings" in effect.acts_on else ()


def linear_wrench(
    frame: Frame, matrix: ArrayLike | None = None, offset: ArrayLike | None = None
) -> SensorStep:
    """Return w' = A w + b in the axes of a frame: matrix (6, 6), by default the identity; offset (6,), N and N·m."""
    return {
        "kind": "linear_wrench",
        "axes": "gripper" if frame == "sensor" else "tissue",
        "matrix": np.asarray(np.eye(6) if matrix is None else matrix, dtype=float).tolist(),
        "offset": np.asarray(np.zeros(6) if offset is None else offset, dtype=float).tolist(),
    }


def zero_of_wrench(axes: Axes) -> SensorStep:
    """Return the zero that was taken at rest, in the given axes."""
    return {"kind": "zero_of_wrench", "axes": axes}


def zero_of_beads() -> SensorStep:
    """Return that the beads' motion since rest was added to their stated rest positions."""
    return {"kind": "zero_of_beads"}


def delay(stream: Literal["wrench", "beads"], seconds: float) -> SensorStep:
    """Return a stream that lags by so many seconds; one that leads has less than zero."""
    return {"kind": f"delay_of_{stream}", "seconds": float(seconds)}


def filter_of_wrench(seconds: float) -> SensorStep:
    """Return a filter of the first order with this time constant, in the sensor's axes, settled at the first row."""
    return {"kind": "filter_of_wrench", "seconds": float(seconds)}


def wave_of_wrench(sine: ArrayLike, cosine: ArrayLike, period: float, phase: float) -> SensorStep:
    """Return s (sin φ − sin φ₁) + c (cos φ − cos φ₁), s and c (6,), N and N·m, in the gripper's axes.

    φ begins at the first row with φ₁ = ``phase``, rad, and grows by 2π in each ``period``, s.
    """
    return {
        "kind": "wave_of_wrench",
        "sine": np.asarray(sine, dtype=float).tolist(),
        "cosine": np.asarray(cosine, dtype=float).tolist(),
        "period": float(period),
        "phase_at_first_row": float(phase),
    }


def slow_clock_of_wrench(rate: float) -> SensorStep:
    """Return a stream that lags by so many seconds more each second from the first row; one that leads has less."""
    return {"kind": "slow_clock_of_wrench", "rate": float(rate)}


def power_of_load(source: int, target: int, power: int, factor: float) -> SensorStep:
    """Return w'_target = w_target + factor · w_source^power, axes from 0 in the sensor's, N and N·m."""
    return {
        "kind": "power_of_load",
        "source": source,
        "target": target,
        "power": power,
        "factor": float(factor),
    }


def mount_that_gives(rotation: ArrayLike = (0, 0, 0), lever: ArrayLike = (0, 0, 0)) -> SensorStep:
    """Return the sensor's rotation vector, rad/N, and its centre, m/N, per force (N), in the gripper's axes, (3,)."""
    return {
        "kind": "mount_that_gives",
        "rotation_per_force": np.asarray(rotation, dtype=float).tolist(),
        "lever_per_force": np.asarray(lever, dtype=float).tolist(),
    }


def camera_frame(matrix: ArrayLike, shift: ArrayLike, seen: Literal["positions", "motion"]) -> SensorStep:
    """Return x' = x + M x + t: M (3, 3), t (3,) in m, of the beads' positions or of their motion since rest."""
    return {
        "kind": "camera_frame",
        "matrix": np.asarray(matrix, dtype=float).tolist(),
        "shift": np.asarray(shift, dtype=float).tolist(),
        "seen": seen,
    }
