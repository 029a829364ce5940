"""Sensors and cameras as a diagnosis has found them, around the observations of any simulator.

This file needs numpy and nothing else; it is copied as it stands beside ``sensors.json``:

    import json
    from sensors import Observations, as_recorded

    steps = json.load(open("sensors.json"))["experiments"]["pull"]
    recorded = as_recorded(Observations(time, position, rotation, wrench, beads, beads[0]), steps)

SI units, tissue frame. The wrench is what the tissue exerts on the gripper, with its torque about the gripper's origin.
Steps act in their order: what the cameras and the sensor do comes as it stands in ``sensors.json``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Step = Mapping[str, Any]


@dataclass(frozen=True)
class Observations:
    """What a simulator gives in n rows, with m beads.

    Attributes
    ----------
    time : (n,) s
    position : (n, 3) the gripper's origin, m
    rotation : (n, 3, 3) matrices of the gripper's rotation from rest
    wrench : (n, 6) force (N) and torque about the gripper's origin (N·m), of the tissue on the gripper, tissue axes
    beads : (n, m, 3) m
    stated_rest : (m, 3) where the beads are said to be at rest, m
    reported_position : (n, 3) what the robot says of its position; where left out, the true one
    rest_wrench, rest_beads : (6,), (m, 3) with the gripper at rest; where left out, those of the first row
    """

    time: FloatArray
    position: FloatArray
    rotation: FloatArray
    wrench: FloatArray
    beads: FloatArray
    stated_rest: FloatArray
    reported_position: FloatArray | None = None
    rest_wrench: FloatArray | None = None
    rest_beads: FloatArray | None = None


def as_recorded(observations: Observations, steps: Sequence[Step]) -> Observations:
    """Return observations as sensors and cameras with these steps would have recorded them.

    Raises
    ------
    ValueError
        A step is of a kind that this file does not know.
    """
    for step in steps:
        if step["kind"] not in _KINDS:
            raise ValueError(f"no step is called {step['kind']!r}; this file knows {', '.join(_KINDS)}")
        observations = _KINDS[step["kind"]](observations, step)
    return observations


def _turned(rotation: FloatArray, wrench: FloatArray) -> FloatArray:
    """Return force and torque (n, 6), each turned by matrices (n, 3, 3)."""
    pairs = np.broadcast_to(wrench, (len(rotation), 6)).reshape(-1, 2, 3)
    return np.asarray(np.einsum("nij,nkj->nki", rotation, pairs).reshape(-1, 6))


def _in_gripper(rotation: FloatArray, wrench: FloatArray) -> FloatArray:
    return _turned(rotation.swapaxes(1, 2), wrench)


def _rest_wrench(observations: Observations) -> FloatArray:
    return observations.wrench[0] if observations.rest_wrench is None else observations.rest_wrench


def _rest_beads(observations: Observations) -> FloatArray:
    return observations.beads[0] if observations.rest_beads is None else observations.rest_beads


def _linear_wrench(seen: Observations, step: Step) -> Observations:
    matrix, offset = np.asarray(step["matrix"]), np.asarray(step["offset"])
    if step["axes"] == "tissue":
        return replace(seen, wrench=seen.wrench @ matrix.T + offset)
    read = _in_gripper(seen.rotation, seen.wrench) @ matrix.T + offset
    return replace(seen, wrench=_turned(seen.rotation, read))


def _drift_of_wrench(seen: Observations, step: Step) -> Observations:
    time, constant, power = seen.time, step["time_constant"], step["power"]
    grown = time if constant is None else -constant * np.expm1(-time / constant)
    if power is not None:  # its rate is the mean one over the first minute
        grown = 60.0 * (time / 60.0) ** power
    drift = np.outer(grown + step["seconds_before"], step["rate"])
    if step["axes"] == "gripper":
        drift = _turned(seen.rotation, drift)
    return replace(seen, wrench=seen.wrench + drift)


def _weight_on_sensor(seen: Observations, step: Step) -> Observations:
    down = np.einsum("nji,j->ni", seen.rotation, np.asarray(step["gravity"]))
    weight = np.hstack([step["mass"] * down, np.cross(step["moment"], down)])
    return replace(seen, wrench=seen.wrench + _turned(seen.rotation, weight - weight[0]))


def _zero_of_wrench(seen: Observations, step: Step) -> Observations:
    zero = _rest_wrench(seen)
    return replace(
        seen, wrench=seen.wrench - (_turned(seen.rotation, zero) if step["axes"] == "gripper" else zero)
    )


def _torque_about_reported_origin(seen: Observations, step: Step) -> Observations:
    reported = seen.position if seen.reported_position is None else seen.reported_position
    torque = seen.wrench[:, 3:] + np.cross(seen.position - reported, seen.wrench[:, :3])
    return replace(seen, wrench=np.hstack([seen.wrench[:, :3], torque]))


def _shifted(time: FloatArray, rows: FloatArray, seconds: float | FloatArray) -> FloatArray:
    """Return rows (n, k) as they were so many seconds before; at the ends they stay."""
    return np.column_stack([np.interp(time - seconds, time, column) for column in rows.T])


def _delay_of_wrench(seen: Observations, step: Step) -> Observations:
    late = _shifted(seen.time, _in_gripper(seen.rotation, seen.wrench), step["seconds"])
    return replace(seen, wrench=_turned(seen.rotation, late))


def _filter_of_wrench(seen: Observations, step: Step) -> Observations:
    felt, constant = _in_gripper(seen.rotation, seen.wrench), step["seconds"]
    read = felt.copy()
    for n in range(1, len(felt) if constant else 0):
        elapsed = seen.time[n] - seen.time[n - 1]
        steady = (
            constant * (felt[n] - felt[n - 1]) / elapsed
        )  # how far behind it is in the end, of a steady change
        behind = felt[n - 1] - read[n - 1]
        read[n] = felt[n] - steady - (behind - steady) * np.exp(-elapsed / constant)
    return replace(seen, wrench=_turned(seen.rotation, read))


def _slow_clock_of_wrench(seen: Observations, step: Step) -> Observations:
    late = step["rate"] * (seen.time - seen.time[0])
    read = _shifted(seen.time, _in_gripper(seen.rotation, seen.wrench), late)
    return replace(seen, wrench=_turned(seen.rotation, read))


def _power_of_load(seen: Observations, step: Step) -> Observations:
    read = _in_gripper(seen.rotation, seen.wrench)
    read[:, step["target"]] += step["factor"] * read[:, step["source"]] ** step["power"]
    return replace(seen, wrench=_turned(seen.rotation, read))


def _rotations(vectors: FloatArray) -> FloatArray:
    """Return the matrices (n, 3, 3) of rotation vectors (n, 3), rad, by Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = vectors.T
    none = np.zeros_like(x)
    cross = np.array([[none, -z, y], [z, none, -x], [-y, x, none]]).transpose(2, 0, 1)
    # numpy's sinc is sin(πx)/(πx), so that nothing is divided by an angle of zero.
    half = np.sinc(angle / (2 * np.pi))
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * half**2 * (cross @ cross))


def _mount_that_gives(seen: Observations, step: Step) -> Observations:
    felt = _in_gripper(seen.rotation, seen.wrench)
    load = np.linalg.norm(felt[:, :3], axis=1)
    levers = np.outer(load, step["lever_per_force"])
    about = np.hstack([felt[:, :3], felt[:, 3:] - np.cross(levers, felt[:, :3])])
    turned_back = _rotations(-np.outer(load, step["rotation_per_force"]))
    return replace(seen, wrench=_turned(seen.rotation, _turned(turned_back, about)))


def _wave_of_wrench(seen: Observations, step: Step) -> Observations:
    begun = step["phase_at_first_row"]
    phase = begun + 2 * np.pi * (seen.time - seen.time[0]) / step["period"]
    wave = np.outer(np.sin(phase) - np.sin(begun), step["sine"])
    wave += np.outer(np.cos(phase) - np.cos(begun), step["cosine"])
    return replace(seen, wrench=seen.wrench + _turned(seen.rotation, wave))


def _delay_of_beads(seen: Observations, step: Step) -> Observations:
    late = _shifted(seen.time, seen.beads.reshape(len(seen.time), -1), step["seconds"])
    return replace(seen, beads=late.reshape(seen.beads.shape))


def _camera_frame(seen: Observations, step: Step) -> Observations:
    def through(positions: FloatArray) -> FloatArray:
        return np.asarray(positions + positions @ np.asarray(step["matrix"]).T + np.asarray(step["shift"]))

    rest = _rest_beads(seen)
    if step["seen"] == "motion":
        return replace(seen, beads=through(seen.beads) - (through(rest) - rest), rest_beads=rest)
    return replace(seen, beads=through(seen.beads), rest_beads=through(rest))


def _zero_of_beads(seen: Observations, step: Step) -> Observations:
    return replace(seen, beads=seen.stated_rest + (seen.beads - _rest_beads(seen)))


def _during(seen: Observations, step: Step) -> NDArray[np.bool_]:
    if step["seconds"] is None:
        return np.zeros(len(seen.time), dtype=bool)
    begin, end = step["seconds"]
    return (seen.time >= begin) & (seen.time <= end)


def _bead_aside(seen: Observations, step: Step) -> Observations:
    beads = seen.beads.copy()
    beads[_during(seen, step), step["bead"]] += np.asarray(step["offset"])
    return replace(seen, beads=beads)


def _bead_behind(seen: Observations, step: Step) -> Observations:
    number, beads = step["bead"], seen.beads.copy()
    beads[:, number] -= step["share"] * (beads[:, number] - seen.stated_rest[number])
    return replace(seen, beads=beads)


def _beads_exchanged(seen: Observations, step: Step) -> Observations:
    rows, (first, second) = _during(seen, step), step["beads"]
    beads = seen.beads.copy()
    shift = step["share"] * (beads[rows, second] - beads[rows, first])
    beads[rows, first] += shift
    beads[rows, second] -= shift
    return replace(seen, beads=beads)


_KINDS: dict[str, Callable[[Observations, Step], Observations]] = {
    "linear_wrench": _linear_wrench,
    "drift_of_wrench": _drift_of_wrench,
    "weight_on_sensor": _weight_on_sensor,
    "zero_of_wrench": _zero_of_wrench,
    "torque_about_reported_origin": _torque_about_reported_origin,
    "delay_of_wrench": _delay_of_wrench,
    "filter_of_wrench": _filter_of_wrench,
    "slow_clock_of_wrench": _slow_clock_of_wrench,
    "power_of_load": _power_of_load,
    "mount_that_gives": _mount_that_gives,
    "wave_of_wrench": _wave_of_wrench,
    "delay_of_beads": _delay_of_beads,
    "camera_frame": _camera_frame,
    "zero_of_beads": _zero_of_beads,
    "bead_aside": _bead_aside,
    "bead_behind": _bead_behind,
    "beads_exchanged": _beads_exchanged,
}
