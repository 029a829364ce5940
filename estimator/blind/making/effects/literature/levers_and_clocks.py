"""Levers and weights beyond the force sensor, and the clocks of its stream."""

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
from estimator.blind.making.effects.sensing import TOOL_CENTRE
from estimator.blind.making.scenes.scene import GRAVITY, Drawn, Form, Mechanics, Readings


def _about(kind: str) -> Draw:
    """Torques about another point, which moves with the load, with the experiment, or half with the gripper."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        shift, course = 0.002 * size * drawn_direction(random), courses.by_order(random)
        load = base.law.youngs_modulus / 15e3 * 2.3

        def change(reading: Readings) -> Readings:
            wrench = reading.sensed() if kind != "half_way" else reading.wrench.copy()
            lever = np.broadcast_to(shift, (len(wrench), 3))
            if kind == "by_load":
                lever = np.outer(np.linalg.norm(wrench[:, :3], axis=1) / load, shift)
            elif kind == "by_order":
                lever = np.outer(course(reading), shift)
            else:
                half = Rotation.from_rotvec(reading.rows.rotation.as_rotvec() / 2)
                lever = half.apply(shift)
            wrench[:, 3:] += np.cross(lever, wrench[:, :3])
            return replace(reading, wrench=wrench) if kind == "half_way" else reading.with_sensed(wrench)

        return read_as({"kind": kind, "shift": shift.tolist()}, change)

    return draw


def _weight(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        excess = drawn_sign(random) * min(0.04 * size, 0.3)
        aside = 0.012 * size * drawn_direction(random)
        about, course = drawn_direction(random), courses.by_order(random)

        def load(reading: Readings) -> FloatArray:
            turns = reading.rows.rotation.inv()
            down = turns.apply([0.0, 0.0, -GRAVITY])
            if kind == "centre_alone":
                moment = 0.35 * np.cross(aside, down)
                return np.hstack([np.zeros_like(down), moment])
            if kind == "loose_mass":
                # It rolls to where it is lowest, along the tool's y.
                slides = 0.01 * size * np.tanh(5 * down[:, 1] / GRAVITY)
                moment = 0.2 * np.cross(np.outer(slides, [0.0, 1.0, 0.0]), down)
                return np.hstack([np.zeros_like(down), moment])
            if kind == "tilted_gravity":
                tilted = Rotation.from_rotvec(0.05 * size * about).apply([0.0, 0.0, -GRAVITY])
                weight = 0.35 * (turns.apply(tilted) - down)
                return np.hstack([weight, np.cross(TOOL_CENTRE, weight)])
            weight = excess * course(reading)[:, None] * down
            return np.hstack([weight, np.cross(TOOL_CENTRE, weight)])

        def change(reading: Readings) -> Readings:
            felt = load(reading)
            return reading.with_sensed(reading.sensed() + felt - felt[0])

        parameters: dict[str, object] = {"kind": kind, "excess_mass": excess, "aside": aside.tolist()}
        return read_as(parameters, change)

    return draw


def _seen_at(reading: Readings, seen_s: FloatArray) -> Readings:
    sensed = reading.sensed()
    return reading.with_sensed(np.column_stack([np.interp(seen_s, reading.rows.time, c) for c in sensed.T]))


def _shifted(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        lag, seed = 0.15 * size, int(random.integers(2**31))
        sign, share = drawn_sign(random), float(random.uniform(0.1, 0.4))
        course = courses.stepwise(random)

        def change(reading: Readings) -> Readings:
            time = reading.rows.time
            own = np.random.default_rng([seed, reading.rows.order])
            if kind == "jitter":
                late = lag * own.gamma(1.0, 1.0, len(time))
            elif kind == "drifting":
                late = sign * lag * time / 30
            elif kind == "dropped":
                late = np.where(own.random(len(time)) < share, 5 * lag, 0.0)
            elif kind == "stepwise":
                late = lag * course(reading)
            else:
                late = np.full(len(time), lag * (1 + (reading.rows.order - 1) * 0.8 * sign))
            return _seen_at(reading, time - late)

        return read_as({"kind": kind, "force_lag": lag, "sign": sign, "dropped_share": share}, change)

    return draw


def _filtered(random: Random, size: float, base: Mechanics) -> Drawn:
    """A low-pass filter of first order in the sensor's box, between rows of the file fed by a straight line."""
    time_constant = 0.2 * size

    def change(reading: Readings) -> Readings:
        sensed, time = reading.sensed(), reading.rows.time
        fine = np.arange(time[0], time[-1] + 0.02, 0.02)
        fed = np.column_stack([np.interp(fine, time, c) for c in sensed.T])
        kept = float(np.exp(-0.02 / time_constant))
        out = [fed[0]]
        for value in fed[1:]:
            out.append(kept * out[-1] + (1 - kept) * value)
        held = np.array(out)
        return reading.with_sensed(np.column_stack([np.interp(time, fine, c) for c in held.T]))

    return read_as({"kind": "low-pass", "time_constant": time_constant}, change)


def _stretched(random: Random, size: float, base: Mechanics) -> Drawn:
    """A clock that runs fast or slow, set at the middle of each experiment."""
    rate = drawn_sign(random) * 0.006 * size * drawn_between(random, 0.7, 1.4)

    def change(reading: Readings) -> Readings:
        time = reading.rows.time
        return _seen_at(reading, time + rate * (time - time[-1] / 2))

    return read_as({"kind": "rate", "rate_error": rate}, change)


FORMS: dict[str, tuple[Form, ...]] = {
    "torque_centre": (
        Form("by_load", _about("by_load"), (0.02, 10.0), family="exact"),
        Form("half_way", _about("half_way"), (0.02, 8.0), family="near"),
        Form("by_order", _about("by_order"), (0.02, 10.0), family="exact"),
    ),
    "tool_weight": (
        Form("centre_alone", _weight("centre_alone"), (0.02, 8.0), family="exact"),
        Form("tilted_gravity", _weight("tilted_gravity"), (0.02, 6.0), family="exact"),
        Form("by_order", _weight("by_order"), (0.02, 7.0), family="exact"),
        Form("loose_mass", _weight("loose_mass"), (0.05, 10.0), family="near"),
    ),
    "time_offset": (
        Form("jitter", _shifted("jitter"), (0.05, 6.0), family="far"),
        Form("drifting", _shifted("drifting"), (0.05, 5.0), family="exact"),
        Form("low_pass", _filtered, (0.1, 8.0), family="exact"),
        Form("dropped", _shifted("dropped"), (0.05, 6.0), family="far"),
        Form("by_order", _shifted("by_order"), (0.05, 5.0), family="exact"),
        Form("rate", _stretched, (0.05, 6.0), family="far"),
        Form("stepwise", _shifted("stepwise"), (0.05, 5.0), family="near"),
    ),
}
