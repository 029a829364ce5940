"""How the gripper really moves: lost motion, scale and direction as machines have them."""

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.blind.making.effects.drawing import (
    Draw,
    FloatArray,
    Random,
    drawn_between,
    drawn_sign,
    moved_as,
)
from estimator.blind.making.effects.motion import play
from estimator.blind.making.scenes.retraction import Rows
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics

_X = np.array([1.0, 0.0, 0.0])


def _moved_aside(rows: Rows, by: FloatArray) -> Rows:
    return rows.moved(rows.position + by)


def _distributed_play(random: Random, size: float, base: Mechanics) -> Drawn:
    """Several plays side by side: a joint that yields before it slides (Prandtl 1928; Ishlinskii 1944)."""
    widths = 0.0004 * size * np.sort(random.uniform(0.3, 2.5, 4))
    shares = random.dirichlet(np.full(4, 3.0))

    def change(rows: Rows) -> Rows:
        travel = rows.travel
        outputs = [play(travel, width, -width / 2) + width / 2 for width in widths]
        lost = shares @ np.array(outputs) - travel
        return _moved_aside(rows, np.outer(lost, _X))

    return moved_as({"kind": "distributed", "widths": widths.tolist(), "shares": shares.tolist()}, change)


def _turning_play(random: Random, size: float, base: Mechanics) -> Drawn:
    width, start = 0.012 * size, float(random.uniform(-0.5, 0.5))

    def change(rows: Rows) -> Rows:
        angles = rows.rotation.as_rotvec()
        way = np.linalg.norm(angles, axis=1)
        output = play(way, width, start * width)
        share = (output - output[0]) / np.maximum(way, 1e-9)
        return rows.turned(Rotation.from_rotvec(angles * share[:, None]))

    return moved_as({"kind": "in the turn", "width": width, "start_in_play": start * width}, change)


def _stiction(random: Random, size: float, base: Mechanics) -> Drawn:
    """A drive that sticks: wherever it stops, it stops short of where it was sent by some part of a width."""
    width, seed = 0.0004 * size, int(random.integers(2**31))

    def change(rows: Rows) -> Rows:
        own = np.random.default_rng([seed, rows.order])
        short, missing = 0.0, []
        for step in np.diff(rows.travel, prepend=rows.travel[0]):
            if abs(step) > 1e-9:
                short = float(np.sign(step) * own.uniform(0.0, width))
            missing.append(short)
        return _moved_aside(rows, -np.outer(missing, _X))

    return moved_as({"kind": "sticking", "width": width}, change)


def _recovered(random: Random, size: float, base: Mechanics) -> Drawn:
    """Motion lost at a reversal comes back while the gripper stands: a belt that creeps."""
    width, time = 0.0007 * size, drawn_between(random, 1.0, 10.0)

    def change(rows: Rows) -> Rows:
        output = play(rows.travel, width, -width / 2) + width / 2
        missing, left = output - rows.travel, [0.0]
        for row in range(1, len(missing)):
            pause = rows.time[row] - rows.time[row - 1]
            left.append((left[-1] + missing[row] - missing[row - 1]) * float(np.exp(-pause / time)))
        return _moved_aside(rows, np.outer(left, _X))

    return moved_as({"kind": "recovered", "width": width, "time_constant": time}, change)


def _scaled(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        amount = drawn_sign(random) * 0.03 * size
        pitch, phase = drawn_between(random, 0.004, 0.012), float(random.uniform(0, 2 * np.pi))

        def change(rows: Rows) -> Rows:
            way = rows.position - rows.position[0]
            if kind == "turn":
                return rows.turned(Rotation.from_rotvec(rows.rotation.as_rotvec() * (1 + 2 * amount)))
            if kind == "by_order":
                return _moved_aside(rows, amount * (rows.order - 1) / 2 * way)
            if kind == "bent":
                return _moved_aside(rows, amount * way * (rows.travel / 0.02)[:, None])
            wave = np.sin(2 * np.pi * rows.travel / pitch + phase) - np.sin(phase)
            return _moved_aside(rows, np.outer(0.3 * amount * 0.02 * wave, _X))

        parameters: dict[str, object] = {"kind": kind, "scale_error": amount, "pitch": pitch}
        return moved_as(parameters, change)

    return draw


def _directed(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        angle = drawn_sign(random) * 0.03 * size
        about = np.array([0.0, *random.standard_normal(2)])
        about /= np.linalg.norm(about)
        of_order = random.uniform(-1.0, 1.0, 3)

        def turns_of(rows: Rows) -> FloatArray:
            if kind == "arc":
                return angle * rows.travel / 0.02
            return np.full(len(rows.time), angle * of_order[rows.order - 1])

        def change(rows: Rows) -> Rows:
            if kind == "turn_axis_alone":
                turn = Rotation.from_rotvec(2 * angle * about)
                return rows.turned(turn * rows.rotation * turn.inv())
            turns = Rotation.from_rotvec(np.outer(turns_of(rows), about))
            return rows.moved(rows.position[0] + turns.apply(rows.position - rows.position[0]))

        parameters: dict[str, object] = {"kind": kind, "axis": about.tolist(), "angle": angle}
        if kind == "by_order":
            parameters["share_by_order"] = of_order.tolist()
        return moved_as(parameters, change)

    return draw


FORMS: dict[str, tuple[Form, ...]] = {
    "robot_backlash": (
        Form("distributed", _distributed_play, (0.05, 6.0), family="near"),
        Form("sticking", _stiction, (0.1, 5.0), family="far"),
        Form("in_the_turn", _turning_play, (0.05, 8.0), family="exact"),
        Form("recovered", _recovered, (0.05, 6.0), family="far"),
    ),
    "motion_scale": (
        Form("bent", _scaled("bent"), (0.05, 5.0), family="near"),
        Form("turn_alone", _scaled("turn"), (0.05, 5.0), family="exact"),
        Form("by_order", _scaled("by_order"), (0.05, 5.0), family="exact"),
        Form("periodic", _scaled("periodic"), (0.05, 8.0), family="far"),
    ),
    "motion_direction": (
        Form("arc", _directed("arc"), (0.02, 5.0), family="near"),
        Form("by_order", _directed("by_order"), (0.02, 6.0), family="exact"),
        Form("turn_axis_alone", _directed("turn_axis_alone"), (0.02, 6.0), family="exact"),
    ),
}
