"""Cameras: similarities about any point, of readings, motion or rest, lasting or creeping; one of the pair alone."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.blind.making.effects.drawing import Draw, FloatArray, Random, drawn_direction, drawn_sign
from estimator.blind.making.effects.literature import courses
from estimator.blind.making.effects.literature.courses import Course
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics, Readings, Scene

# Of places (m, 3) or (n, m, 3) and factors that broadcast against them: where they are seen.
_View = Callable[[FloatArray, FloatArray], FloatArray]
_MEASURED = ("readings", "motion", "both", "rest")
# The stereo pair: half its base along x, and its height over the tissue, m.
_HALF_BASE, _HEIGHT = 0.15, 0.6


def _seen(parameters: dict[str, object], view: _View, measured: str, course: Course | None = None) -> Drawn:
    """An effect of the cameras on what they measured: readings, their motion, rest positions, or both.

    Parameters
    ----------
    view : of places and how much of the error there is
    course : of that in the readings; None: all of it always
    """
    whole = np.ones((1, 1))

    def change(reading: Readings) -> Readings:
        share = np.ones(len(reading.beads)) if course is None else course(reading)
        beads = view(reading.beads, share[:, None, None])
        if measured == "motion":
            rest = reading.beads[:1]
            beads = beads - view(rest, np.ones((1, 1, 1))) + rest
        return replace(reading, beads=beads)

    def applied(scene: Scene) -> Scene:
        if measured in ("both", "rest"):
            scene = replace(scene, rest_as_seen=(*scene.rest_as_seen, lambda rest: view(rest, whole)))
        return scene if measured == "rest" else scene.read_by(change)

    return Drawn({**parameters, "measured_by_these_cameras": measured}, applied)


def _origin(random: Random) -> FloatArray:
    return random.uniform(-1.0, 1.0, 3) * np.array([0.08, 0.08, 0.02])


def _scaled(
    measured: str, course_of: Callable[[Random], Course] | None = None, sheared: bool = False
) -> Draw:
    """A scale about any point; that of depth is another, and so may those along x and y be."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        error = drawn_sign(random) * 0.008 * size
        along = error * np.array(
            [1.0, random.uniform(-1.0, 1.0) if sheared else 1.0, random.uniform(0.0, 2.0)]
        )
        origin, course = _origin(random), None if course_of is None else course_of(random)

        def view(places: FloatArray, share: FloatArray) -> FloatArray:
            return places + share * along * (places - origin)

        parameters: dict[str, object] = {"scale_errors": along.tolist(), "origin": origin.tolist()}
        return _seen(parameters, view, measured, course)

    return draw


def _turned(measured: str, course_of: Callable[[Random], Course] | None = None) -> Draw:
    """A turn about any axis through any point."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        turn = drawn_sign(random) * 0.01 * size * drawn_direction(random)
        origin, course = _origin(random), None if course_of is None else course_of(random)

        def view(places: FloatArray, share: FloatArray) -> FloatArray:
            arms = places - origin
            shares = np.broadcast_to(share, (*places.shape[:-1], 1)).reshape(-1, 1)
            turned = Rotation.from_rotvec(shares * turn).apply(arms.reshape(-1, 3))
            return turned.reshape(arms.shape) + origin

        parameters: dict[str, object] = {"rotation": turn.tolist(), "origin": origin.tolist()}
        return _seen(parameters, view, measured, course)

    return draw


def _triangulated(places: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return where a pair sees places whose images are off by ``left`` and ``right`` (..., 2), rad."""
    height = _HEIGHT - places[..., 2]
    slopes = [
        (places[..., 0] - side * _HALF_BASE) / height + off[..., 0]
        for side, off in ((-1.0, left), (1.0, right))
    ]
    depth = 2 * _HALF_BASE / (slopes[0] - slopes[1])
    x = slopes[0] * depth - _HALF_BASE
    y = (places[..., 1] / height + (left[..., 1] + right[..., 1]) / 2) * depth
    return np.stack([x, y, _HEIGHT - depth], axis=-1)


def _one_camera(kind: str) -> Draw:
    """One of the two alone has another focal length or has turned: depth and plane go wrong together."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        error = drawn_sign(random) * (0.004 if kind == "focal_length" else 0.0012) * size
        axis, left = int(random.integers(3)), bool(random.integers(2))
        measured = str(random.choice(_MEASURED[:3]))

        def view(places: FloatArray, share: FloatArray) -> FloatArray:
            height = _HEIGHT - places[..., 2]
            side = -1.0 if left else 1.0
            image = np.stack(
                [(places[..., 0] - side * _HALF_BASE) / height, places[..., 1] / height], axis=-1
            )
            if kind == "focal_length":
                off = error * image
            elif axis == 2:
                off = error * 5 * np.stack([-image[..., 1], image[..., 0]], axis=-1)
            else:
                off = np.zeros_like(image) + error * np.eye(2)[axis]
            none = np.zeros_like(off)
            off = share * off
            return _triangulated(places, *((off, none) if left else (none, off)))

        parameters: dict[str, object] = {"kind": kind, "camera": "left" if left else "right", "error": error}
        if kind == "turned":
            parameters["axis"] = "xyz"[axis]
        return _seen(parameters, view, measured)

    return draw


FORMS: dict[str, tuple[Form, ...]] = {
    "camera_scale": (
        Form("about_any_point", _scaled("readings"), (0.02, 8.0), family="exact", beads=1),
        Form("creeping", _scaled("readings", courses.growing), (0.02, 10.0), family="far", beads=1),
        Form("rest_measured_too", _scaled("both"), (0.02, 8.0), family="exact", beads=1),
        Form("one_focal_length", _one_camera("focal_length"), (0.02, 8.0), family="near", beads=1),
        Form("of_rest_alone", _scaled("rest"), (0.02, 8.0), family="exact", beads=1),
        Form("other_along_y", _scaled("readings", sheared=True), (0.02, 8.0), family="near", beads=1),
        Form("of_the_motion", _scaled("motion"), (0.05, 12.0), family="near", beads=1),
        Form("by_order", _scaled("readings", courses.by_order), (0.02, 8.0), family="exact", beads=1),
        Form("running_on", _scaled("readings", courses.running_on), (0.02, 8.0), family="near", beads=1),
    ),
    "camera_rotation": (
        Form("about_any_point", _turned("readings"), (0.02, 8.0), family="exact", beads=1),
        Form("one_camera", _one_camera("turned"), (0.02, 8.0), family="near", beads=1),
        Form("rest_measured_too", _turned("both"), (0.02, 8.0), family="exact", beads=1),
        Form("knocked_later", _turned("readings", courses.later), (0.02, 8.0), family="exact", beads=1),
        Form("of_the_motion", _turned("motion"), (0.05, 12.0), family="exact", beads=1),
        Form("of_rest_alone", _turned("rest"), (0.02, 8.0), family="exact", beads=1),
        Form("creeping", _turned("readings", courses.running_on), (0.02, 8.0), family="near", beads=1),
    ),
}
