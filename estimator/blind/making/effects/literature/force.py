"""Errors of the force sensor: zero, drift, gains, cross-talk and mounting, as data sheets and users know them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.blind.making.effects.drawing import (
    Draw,
    FloatArray,
    Random,
    drawn_between,
    drawn_direction,
    drawn_sign,
    read_as,
)
from estimator.blind.making.effects.literature import courses
from estimator.blind.making.effects.literature.courses import Course
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics, Readings

# Typical wrenches beside each other, N and N·m.
_UNIT = np.array([1.0, 1.0, 1.0, 0.03, 0.03, 0.03])
_AXES = ("fx", "fy", "fz", "tx", "ty", "tz")


def _sensed_as(parameters: dict[str, object], change: Callable[[FloatArray, Readings], FloatArray]) -> Drawn:
    """An effect on the wrench in the sensor's own frame, (n, 6)."""
    return read_as(parameters, lambda reading: reading.with_sensed(change(reading.sensed(), reading)))


def _added(name: str, scale: float, course_of: Callable[[Random], Course]) -> Draw:
    """A wrench error times a course, in the sensor's or the tissue's frame."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        error, course = scale * size * _UNIT * random.standard_normal(6), course_of(random)
        in_sensor = bool(random.integers(2))

        def change(reading: Readings) -> Readings:
            grown = np.outer(course(reading), error)
            if in_sensor:
                return reading.with_sensed(reading.sensed() + grown)
            return replace(reading, wrench=reading.wrench + grown)

        parameters: dict[str, object] = {
            "course": name,
            "error": error.tolist(),
            "frame": "sensor" if in_sensor else "tissue",
        }
        return read_as(parameters, change)

    return draw


def _both_frames(random: Random, size: float, base: Mechanics) -> Drawn:
    """A zero that is off in the sensor and a constant that software adds to it."""
    own, added = (0.05 * size * _UNIT * random.standard_normal(6) for _ in range(2))

    def change(reading: Readings) -> Readings:
        reading = reading.with_sensed(reading.sensed() + own)
        return replace(reading, wrench=reading.wrench + added)

    return read_as({"in_sensor": own.tolist(), "in_tissue": added.tolist()}, change)


def _zeroed_under_load(random: Random, size: float, base: Mechanics) -> Drawn:
    """The zero was taken while the gripper pulled a little: what the sensor read at some row is missing throughout."""
    share = min(0.05 * size, 0.6)

    def change(wrench: FloatArray, reading: Readings) -> FloatArray:
        return wrench - share * wrench[np.argmax(np.linalg.norm(wrench[:, :3], axis=1))]

    return _sensed_as({"share_of_largest_load": share}, change)


def _gain_drift(random: Random, size: float, base: Mechanics) -> Drawn:
    """The gain changes as the sensor warms."""
    per_minute = drawn_sign(random) * 0.05 * size

    def change(wrench: FloatArray, reading: Readings) -> FloatArray:
        return wrench * (1 + per_minute * reading.rows.time[:, None] / 60)

    return _sensed_as({"gain_per_minute": per_minute}, change)


def _unloaded(load: FloatArray) -> FloatArray:
    """Return by how much a load (n,) has fallen from its largest so far: what strain gauges that creep keep of it."""
    largest = np.maximum.accumulate(np.abs(load))
    return np.asarray(np.sign(load) * (largest - np.abs(load)))


def _gains(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        amount = drawn_sign(random) * min(0.12 * size, 0.6)
        # Of other axes than the pull's hardly more than one experiment tells.
        axis = 0 if kind == "by_order" else int(random.choice([0, 0, 1, 5]))
        course = courses.by_order(random)
        every = 0.08 * size * random.uniform(-1.0, 1.0, 6)
        load = base.law.youngs_modulus / 15e3 * 2.3 * _UNIT

        def change(wrench: FloatArray, reading: Readings) -> FloatArray:
            gains = np.ones_like(wrench)
            if kind == "every_axis":
                gains = gains + every
            elif kind == "torques":
                gains[:, 3:] += amount
            elif kind == "cubic":
                gains[:, axis] += amount * (wrench[:, axis] / load[axis]) ** 2
            elif kind == "one_sign":
                gains[:, axis] += amount * (np.sign(amount) * wrench[:, axis] < 0)
            elif kind == "hysteretic":
                return wrench + amount * np.eye(6)[axis] * _unloaded(wrench[:, axis])[:, None]
            else:
                gains[:, axis] += amount * course(reading)
            return wrench * gains

        parameters: dict[str, object] = {"kind": kind, "axis": _AXES[axis], "gain_error": amount}
        if kind == "every_axis":
            parameters = {"kind": kind, "gain_errors": every.tolist()}
        return _sensed_as(parameters, change)

    return draw


def _leaking(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        matrix = 0.02 * size * random.standard_normal((6, 6)) * _UNIT[:, None] / _UNIT
        np.fill_diagonal(matrix, 0.0)
        load = base.law.youngs_modulus / 15e3 * 2.3
        source, sink = 0, int(random.choice([1, 2, 3, 4, 5]))
        leak = drawn_sign(random) * 0.05 * size * _UNIT[sink]

        def leaked(wrench: FloatArray) -> FloatArray:
            if kind == "full_matrix" or kind == "in_tissue_axes":
                return wrench @ matrix.T
            size_of = wrench[:, source]
            courses_of = {
                "rectified": np.abs(size_of),
                "quadratic": size_of * np.abs(size_of) / load,
                "hysteretic": _unloaded(size_of),
            }
            course = courses_of[kind]
            return np.outer(course, np.eye(6)[sink] * leak)

        def change(reading: Readings) -> Readings:
            if kind == "in_tissue_axes":
                return replace(reading, wrench=reading.wrench + leaked(reading.wrench))
            sensed = reading.sensed()
            return reading.with_sensed(sensed + leaked(sensed))

        parameters: dict[str, object] = {"kind": kind, "matrix": matrix.tolist()}
        if kind not in ("full_matrix", "in_tissue_axes"):
            parameters = {"kind": kind, "from": _AXES[source], "into": _AXES[sink], "leak": leak}
        return read_as(parameters, change)

    return draw


def _turned(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        about, angle = drawn_direction(random), drawn_sign(random) * 0.035 * size
        course, load = courses.by_order(random), base.law.youngs_modulus / 15e3 * 2.3

        def change(reading: Readings) -> Readings:
            sensed = reading.sensed()
            share = np.ones(len(sensed))
            if kind == "by_order":
                share = course(reading)
            elif kind == "by_load":
                share = np.linalg.norm(sensed[:, :3], axis=1) / load
            wrench = reading.wrench if kind == "in_tissue_axes" else sensed
            turns = Rotation.from_rotvec(np.outer(angle * share, about))
            torque = wrench[:, 3:] if kind == "force_alone" else turns.apply(wrench[:, 3:])
            turned = np.hstack([turns.apply(wrench[:, :3]), torque])
            return (
                replace(reading, wrench=turned) if kind == "in_tissue_axes" else reading.with_sensed(turned)
            )

        return read_as({"kind": kind, "axis": about.tolist(), "angle": angle}, change)

    return draw


def _two_rates(random: Random, size: float, base: Mechanics) -> Drawn:
    """A quick warming and a slow one, of different axes."""
    quick, slow = (0.08 * size * _UNIT * random.standard_normal(6) for _ in range(2))
    time = drawn_between(random, 4.0, 15.0)

    def change(wrench: FloatArray, reading: Readings) -> FloatArray:
        t = reading.rows.time
        return wrench + np.outer(-np.expm1(-t / time), quick) + np.outer(t / 60, slow)

    return _sensed_as(
        {"quick": quick.tolist(), "slow_per_minute": slow.tolist(), "time_constant": time}, change
    )


FORMS: dict[str, tuple[Form, ...]] = {
    "force_bias": (
        Form("by_order", _added("by order", 0.08, courses.by_order), family="far"),
        Form("both_frames", _both_frames, family="near"),
        Form("zeroed_under_load", _zeroed_under_load, (0.05, 10.0), family="far"),
        Form("from_a_later_experiment_on", _added("later", 0.08, courses.later), family="near"),
    ),
    "force_drift": (
        Form("periodic", _added("periodic", 0.08, courses.periodic), (0.02, 8.0), family="exact"),
        Form("root_of_time", _added("root of time", 0.1, courses.root_of_time), (0.02, 8.0), family="exact"),
        Form("random_walk", _added("random walk", 0.08, courses.random_walk), (0.02, 8.0), family="far"),
        Form("of_the_gain", _gain_drift, (0.02, 8.0), family="far"),
        Form("running_on", _added("running on", 0.08, courses.running_on), (0.02, 6.0), family="exact"),
        Form("two_rates", _two_rates, (0.02, 8.0), family="near"),
    ),
    "force_axis_gain": (
        Form("every_axis", _gains("every_axis"), (0.02, 8.0), family="exact"),
        Form("cubic", _gains("cubic"), (0.05, 5.0), family="exact"),
        Form("torques", _gains("torques"), (0.02, 5.0), family="exact"),
        Form("by_order", _gains("by_order"), (0.02, 5.0), family="exact"),
        Form("one_sign", _gains("one_sign"), (0.05, 5.0), family="exact"),
        Form("hysteretic", _gains("hysteretic"), (0.05, 5.0), family="far"),
    ),
    "force_crosstalk": (
        Form("full_matrix", _leaking("full_matrix"), (0.02, 8.0), family="exact"),
        Form("quadratic", _leaking("quadratic"), (0.02, 8.0), family="exact"),
        Form("in_tissue_axes", _leaking("in_tissue_axes"), (0.02, 8.0), family="exact"),
        Form("rectified", _leaking("rectified"), (0.02, 8.0), family="exact"),
        Form("hysteretic", _leaking("hysteretic"), (0.05, 8.0), family="far"),
    ),
    "force_frame_rotation": (
        Form("in_tissue_axes", _turned("in_tissue_axes"), (0.02, 6.0), family="exact"),
        Form("by_load", _turned("by_load"), (0.02, 8.0), family="exact"),
        Form("force_alone", _turned("force_alone"), (0.02, 6.0), family="near"),
        Form("by_order", _turned("by_order"), (0.02, 8.0), family="exact"),
    ),
}
