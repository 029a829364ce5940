"""Effects of how the instruments see the truth: force sensor, clocks and cameras."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.blind.making.effects.drawing import (
    Draw,
    FloatArray,
    Random,
    drawn_direction,
    drawn_sign,
    read_as,
)
from estimator.blind.making.scenes.retraction import KINDS
from estimator.blind.making.scenes.scene import BEADS, GRAVITY, Drawn, Form, Mechanics, Reading, Readings

TOOL_CENTRE = (0.0, 0.0, 0.06)
_AXES = ("fx", "fy", "fz", "tx", "ty", "tz")
# Typical wrenches beside each other, N and N·m.
_UNIT = np.array([1.0, 1.0, 1.0, 0.03, 0.03, 0.03])


def _plus(error: FloatArray, in_sensor: bool) -> Callable[[Readings, FloatArray], Readings]:
    """Add a wrench error times a factor of each row, in the sensor's or the tissue's frame."""

    def add(reading: Readings, factor: FloatArray) -> Readings:
        if in_sensor:
            return reading.with_sensed(reading.sensed() + np.outer(factor, error))
        return replace(reading, wrench=reading.wrench + np.outer(factor, error))

    return add


def _bias(several: bool, in_sensor: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        pattern = random.standard_normal(6) if several else np.eye(6)[random.integers(6)] * drawn_sign(random)
        error = 0.06 * size * _UNIT * pattern
        add = _plus(error, in_sensor)
        parameters: dict[str, object] = {
            "force": error[:3].tolist(),
            "torque": error[3:].tolist(),
            "frame": "sensor" if in_sensor else "tissue",
        }
        return read_as(parameters, lambda reading: add(reading, np.ones(len(reading.wrench))))

    return draw


def _drift(saturating: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        in_sensor = bool(random.integers(2))
        rate = 0.1 * size * _UNIT * random.standard_normal(6)
        saturation = float(random.uniform(15.0, 40.0)) if saturating else 0.0
        add = _plus(rate / 60.0, in_sensor)

        def reading_of(reading: Readings) -> Readings:
            time = reading.rows.time
            return add(reading, saturation * -np.expm1(-time / saturation) if saturating else time)

        parameters: dict[str, object] = {
            "force_per_minute": rate[:3].tolist(),
            "torque_per_minute": rate[3:].tolist(),
            "saturation_time": saturation,
            "frame": "sensor" if in_sensor else "tissue",
        }
        return read_as(parameters, reading_of)

    return draw


def _mixed(matrix: FloatArray) -> Reading:
    """A sensor that reads its own wrench times a matrix, (6, 6)."""
    return lambda reading: reading.with_sensed(reading.sensed() @ matrix.T)


def _gain(axis: int | None) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        one = int(random.choice([1, 5])) if axis is None else axis
        gain = 1 + drawn_sign(random) * min(0.12 * size, 0.6)
        matrix = np.eye(6)
        matrix[one, one] = gain
        return read_as({"axis": _AXES[one], "gain": gain, "frame": "sensor"}, _mixed(matrix))

    return draw


def _crosstalk(onto_torque: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        source = 0
        sink = int(random.choice([3, 4, 5]) if onto_torque else random.choice([1, 2]))
        leak = float(drawn_sign(random) * 0.04 * size * _UNIT[sink] / _UNIT[source])
        matrix = np.eye(6)
        matrix[sink, source] = leak
        parameters: dict[str, object] = {"from": _AXES[source], "into": _AXES[sink], "leak": leak}
        return read_as(parameters, _mixed(matrix))

    return draw


def _sensor_turned(axis: tuple[float, float, float] | None) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        about = drawn_direction(random) if axis is None else np.array(axis)
        angle = drawn_sign(random) * 0.035 * size
        turn = Rotation.from_rotvec(angle * about).as_matrix()
        matrix = np.asarray(np.kron(np.eye(2), turn), dtype=np.float64)
        return read_as({"axis": about.tolist(), "angle": angle}, _mixed(matrix))

    return draw


def _centre(in_sensor: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        shift = 0.002 * size * drawn_direction(random)

        def reading_of(reading: Readings) -> Readings:
            wrench = reading.sensed() if in_sensor else reading.wrench.copy()
            wrench[:, 3:] += np.cross(shift, wrench[:, :3])
            return reading.with_sensed(wrench) if in_sensor else replace(reading, wrench=wrench)

        frame = "gripper" if in_sensor else "tissue"
        return read_as({"shift": shift.tolist(), "frame": frame}, reading_of)

    return draw


def _tool(centre_too: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        excess = drawn_sign(random) * min(0.04 * size, 0.3)
        centre = np.array(TOOL_CENTRE)
        if centre_too:
            centre = centre + random.uniform(-0.02, 0.02, 3)

        def reading_of(reading: Readings) -> Readings:
            weight = excess * GRAVITY * reading.rows.rotation.inv().apply([0.0, 0.0, -1.0])
            load = np.hstack([weight, np.cross(centre, weight)])
            return reading.with_sensed(reading.sensed() + load - load[0])

        return read_as({"excess_mass": excess, "excess_centre": centre.tolist()}, reading_of)

    return draw


def _late(leads: bool, varies: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        lag = (-1 if leads else 1) * 0.15 * size * np.ones(3)
        if varies:
            lag = lag * random.uniform(0.6, 1.4, 3)

        def reading_of(reading: Readings) -> Readings:
            time = reading.rows.time
            seen = time - lag[reading.rows.order - 1]
            sensed = reading.sensed()
            return reading.with_sensed(np.column_stack([np.interp(seen, time, c) for c in sensed.T]))

        return read_as({"force_lag": float(lag.mean()), "force_lag_by_order": lag.tolist()}, reading_of)

    return draw


def _camera_scale(depth: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        scale = 1 + drawn_sign(random) * 0.005 * size
        factors = np.array([scale, scale, 1.0 if depth else scale])
        return read_as(
            {"scale": scale, "axes": "xy" if depth else "xyz"},
            lambda reading: replace(reading, beads=reading.beads * factors),
        )

    return draw


def _camera_turned(axis: tuple[float, float, float] | None) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        about = drawn_direction(random) if axis is None else np.array(axis)
        angle = drawn_sign(random) * 0.006 * size
        turn = Rotation.from_rotvec(angle * about).as_matrix()
        return read_as(
            {"axis": about.tolist(), "angle": angle},
            lambda reading: replace(reading, beads=reading.beads @ turn.T),
        )

    return draw


def _exchanged(neighbours: bool, everywhere: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        first = int(random.integers(base.beads))
        others = [b for b in range(base.beads) if b != first]
        if neighbours and base.beads == BEADS:
            row, column = divmod(first, 4)
            others = [b for b in others if abs(b // 4 - row) + abs(b % 4 - column) == 1]
        second = int(random.choice(others))
        share = float(random.uniform(0.1, 0.7))
        kind = str(random.choice(KINDS))

        def reading_of(reading: Readings) -> Readings:
            if not everywhere and reading.rows.kind != kind:
                return reading
            beads = reading.beads.copy()
            late = reading.rows.time >= share * reading.rows.time[-1]
            beads[np.ix_(late, [first, second])] = beads[np.ix_(late, [second, first])]
            return replace(reading, beads=beads)

        parameters: dict[str, object] = {
            "fiducials": [first, second],
            "from_share_of_time": share,
            "experiment": "all" if everywhere else kind,
        }
        return read_as(parameters, reading_of)

    return draw


def _misread(in_plane: bool, everywhere: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        bead = int(random.integers(base.beads))
        error = drawn_direction(random) * np.array([1.0, 1.0, 0.0 if in_plane else 1.0])
        error = 0.0006 * size * error / np.linalg.norm(error)
        kind = str(random.choice(KINDS))

        def reading_of(reading: Readings) -> Readings:
            if not everywhere and reading.rows.kind != kind:
                return reading
            beads = reading.beads.copy()
            beads[:, bead] += error
            return replace(reading, beads=beads)

        parameters: dict[str, object] = {
            "fiducial": bead,
            "error": error.tolist(),
            "experiment": "all" if everywhere else kind,
        }
        return read_as(parameters, reading_of)

    return draw


FORMS: dict[str, tuple[Form, ...]] = {
    "force_bias": (
        Form("one_axis_sensor", _bias(several=False, in_sensor=True)),
        Form("several_axes_sensor", _bias(several=True, in_sensor=True)),
        Form("several_axes_tissue", _bias(several=True, in_sensor=False)),
    ),
    "force_drift": (
        Form("linear", _drift(saturating=False), (0.02, 8.0)),
        Form("saturating", _drift(saturating=True), (0.02, 8.0)),
    ),
    "force_axis_gain": (
        Form("fx", _gain(0), (0.05, 4.0)),
        Form("fy_or_tz", _gain(None), (0.05, 4.0)),
    ),
    "force_crosstalk": (
        Form("force_into_force", _crosstalk(onto_torque=False), (0.02, 6.0)),
        Form("force_into_torque", _crosstalk(onto_torque=True), (0.02, 6.0)),
    ),
    "force_frame_rotation": (
        Form("about_any_axis", _sensor_turned(None), (0.02, 6.0)),
        Form("about_z", _sensor_turned((0.0, 0.0, 1.0)), (0.02, 6.0)),
        Form("about_y", _sensor_turned((0.0, 1.0, 0.0)), (0.02, 6.0)),
    ),
    "torque_centre": (
        Form("fixed_to_gripper", _centre(in_sensor=True), (0.02, 8.0)),
        Form("fixed_to_tissue", _centre(in_sensor=False), (0.02, 8.0)),
    ),
    "tool_weight": (
        Form("mass", _tool(centre_too=False), (0.02, 7.0)),
        Form("mass_and_centre", _tool(centre_too=True), (0.02, 7.0)),
    ),
    "time_offset": (
        Form("lags", _late(leads=False, varies=False), (0.05, 5.0)),
        Form("leads", _late(leads=True, varies=False), (0.05, 5.0)),
        Form("lags_unevenly", _late(leads=False, varies=True), (0.05, 5.0), family="near"),
    ),
    "camera_scale": (
        Form("uniform", _camera_scale(depth=False), (0.02, 8.0), beads=1),
        Form("in_the_plane", _camera_scale(depth=True), (0.02, 8.0), beads=1),
    ),
    "camera_rotation": (
        Form("about_z", _camera_turned((0.0, 0.0, 1.0)), (0.02, 8.0), beads=1),
        Form("about_any_axis", _camera_turned(None), (0.02, 8.0), beads=1),
    ),
    "fiducial_mislabel": (
        Form("neighbours_one_experiment", _exchanged(neighbours=True, everywhere=False), (1.0, 1.0), beads=2),
        Form("any_two_all_experiments", _exchanged(neighbours=False, everywhere=True), (1.0, 1.0), beads=2),
    ),
    "fiducial_misread": (
        Form("in_plane_all", _misread(in_plane=True, everywhere=True), (0.05, 6.0), beads=1),
        Form("any_direction_all", _misread(in_plane=False, everywhere=True), (0.05, 6.0), beads=1),
        Form("one_experiment", _misread(in_plane=False, everywhere=False), (0.05, 6.0), beads=1),
    ),
}
