"""Effects of how the gripper really moves."""

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.blind.making.effects.drawing import Draw, FloatArray, Random, drawn_sign, moved_as
from estimator.blind.making.scenes.retraction import Rows
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics


def play(values: FloatArray, width: float, start: float) -> FloatArray:
    """Follow values through a play: the output moves only when it is pushed from half a width away.

    ``start`` is where it stands at first, relative to the first value, from -width/2 to +width/2.
    """
    output = [values[0] + start]
    for value in values[1:]:
        output.append(float(np.clip(output[-1], value - width / 2, value + width / 2)))
    return np.array(output)


def _backlash(taken_up: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        width = 0.0004 * size
        start = -width / 2 if taken_up else float(random.uniform(-0.3, 0.5)) * width

        def change(rows: Rows) -> Rows:
            output = play(rows.travel, width, start)
            lost = output - output[0] - rows.travel
            return rows.moved(rows.position + np.outer(lost, [1.0, 0.0, 0.0]))

        parameters: dict[str, object] = {
            "width": width,
            "start_in_play": start,
            "taken_up_at_start": taken_up,
        }
        return moved_as(parameters, change)

    return draw


def _scaled(random: Random, size: float, base: Mechanics) -> Drawn:
    scale = 1 + drawn_sign(random) * 0.03 * size
    return moved_as(
        {"scale": scale},
        lambda rows: rows.moved(rows.position[0] + scale * (rows.position - rows.position[0])),
    )


def _scaled_with_turn(random: Random, size: float, base: Mechanics) -> Drawn:
    scale = 1 + drawn_sign(random) * 0.03 * size

    def change(rows: Rows) -> Rows:
        way = rows.position - rows.position[0]
        angles = rows.rotation.as_rotvec() * scale
        return rows.moved(rows.position[0] + scale * way).turned(Rotation.from_rotvec(angles))

    return moved_as({"scale": scale, "scales_rotation_too": True}, change)


def _turned(axis: tuple[float, float, float] | None, with_rotation: bool) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        angle = drawn_sign(random) * 0.03 * size
        about = np.array(axis) if axis else np.array([0.0, *random.standard_normal(2)])
        about = about / np.linalg.norm(about)
        turn = Rotation.from_rotvec(angle * about)

        def change(rows: Rows) -> Rows:
            rows = rows.moved(rows.position[0] + turn.apply(rows.position - rows.position[0]))
            return rows.turned(turn * rows.rotation * turn.inv()) if with_rotation else rows

        parameters: dict[str, object] = {
            "axis": about.tolist(),
            "angle": angle,
            "turns_rotation_axis_too": with_rotation,
        }
        return moved_as(parameters, change)

    return draw


FORMS: dict[str, tuple[Form, ...]] = {
    "robot_backlash": (
        Form("taken_up", _backlash(taken_up=True), (0.05, 5.0)),
        Form("centred", _backlash(taken_up=False), (0.05, 5.0)),
    ),
    "motion_scale": (
        Form("translation", _scaled, (0.05, 4.0)),
        Form("translation_and_rotation", _scaled_with_turn, (0.05, 4.0)),
    ),
    "motion_direction": (
        Form("about_z", _turned((0.0, 0.0, 1.0), with_rotation=False), (0.02, 5.0)),
        Form("about_y", _turned((0.0, 1.0, 0.0), with_rotation=False), (0.02, 5.0)),
        Form("any_with_rotation", _turned(None, with_rotation=True), (0.02, 5.0)),
    ),
}
