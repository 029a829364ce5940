"""Effects that no label of the catalogue means: the right answer to them is "unknown"."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.blind.making.effects import outside_tissue
from estimator.blind.making.effects.drawing import Draw, FloatArray, Random, drawn_sign, read_as
from estimator.blind.making.scenes.retraction import KINDS, Rows
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics, Readings


def _lens(random: Random, size: float, base: Mechanics) -> Drawn:
    strength = drawn_sign(random) * 4.0 * size
    axis = np.array([*random.uniform(-0.03, 0.03, 2), 0.005])

    def reading_of(reading: Readings) -> Readings:
        away = reading.beads - axis
        radius2 = (away[..., :2] ** 2).sum(axis=-1, keepdims=True)
        beads = reading.beads.copy()
        beads[..., :2] += strength * radius2 * away[..., :2]
        return replace(reading, beads=beads)

    return read_as({"cubic_per_m2": strength, "optical_axis": axis[:2].tolist()}, reading_of)


def _refraction(random: Random, size: float, base: Mechanics) -> Drawn:
    slant = 0.3 * size * np.array([random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), drawn_sign(random)])

    def reading_of(reading: Readings) -> Readings:
        depth = 0.005 - reading.beads[..., 2]
        grown = depth + 60.0 * depth * np.abs(depth)
        return replace(reading, beads=reading.beads + grown[..., None] * slant)

    return read_as({"shift_per_depth": slant.tolist()}, reading_of)


def _jammed_wrist(random: Random, size: float, base: Mechanics) -> Drawn:
    limit = float(np.clip(1 - 0.25 * size, 0.05, 0.97))

    def change(rows: Rows) -> Rows:
        angles = rows.rotation.as_rotvec()
        size_of = np.linalg.norm(angles, axis=1, keepdims=True)
        most = limit * size_of.max()
        shorter = np.minimum(1.0, most / np.maximum(size_of, 1e-9))
        return rows.turned(Rotation.from_rotvec(angles * shorter))

    return Drawn(
        {"executed_share_of_turn": limit},
        lambda scene: replace(scene, mechanics=scene.mechanics.with_motion(change)),
    )


def _creeping_camera(random: Random, size: float, base: Mechanics) -> Drawn:
    rate = 0.0002 * size * random.standard_normal(3)
    turning = 0.001 * size * random.standard_normal(3)

    def reading_of(reading: Readings) -> Readings:
        minutes = reading.rows.time[:, None, None] / 60
        turned = np.cross(turning, reading.beads)
        return replace(reading, beads=reading.beads + minutes * (rate + turned))

    return read_as({"m_per_minute": rate.tolist(), "rad_per_minute": turning.tolist()}, reading_of)


def _shaking_camera(random: Random, size: float, base: Mechanics) -> Drawn:
    std = 0.00008 * size
    seed = int(random.integers(2**31))

    def reading_of(reading: Readings) -> Readings:
        own = np.random.default_rng([seed, reading.rows.order])
        shake = std * own.standard_normal((len(reading.beads), 1, 3))
        return replace(reading, beads=reading.beads + shake)

    return read_as({"common_std": std}, reading_of)


def _cable(random: Random, size: float, base: Mechanics) -> Drawn:
    stiffness = 4.0 * size
    base_point = np.array([random.uniform(-0.1, 0.1), drawn_sign(random) * random.uniform(0.1, 0.25), 0.2])
    hook = np.array([0.0, 0.0, 0.10])
    slack = float(random.uniform(0.0, 0.004))

    def reading_of(reading: Readings) -> Readings:
        rows = reading.rows
        arm = rows.rotation.apply(hook)
        away = base_point - rows.position - arm
        length = np.linalg.norm(away, axis=1, keepdims=True)
        tension = stiffness * np.maximum(length - length[0] - slack, 0.0)
        force = tension * away / length
        return replace(reading, wrench=reading.wrench + np.hstack([force, np.cross(arm, force)]))

    parameters: dict[str, object] = {
        "stiffness": stiffness,
        "base_point": base_point.tolist(),
        "hook_in_gripper_frame": hook.tolist(),
        "slack": slack,
    }
    return read_as(parameters, reading_of)


def _loose_bead(random: Random, size: float, base: Mechanics) -> Drawn:
    bead = int(random.integers(base.beads))
    onset = float(random.uniform(0.004, 0.014))
    slide = np.array([*random.standard_normal(2), 0.0]) * 0.0012 * size
    kind = str(random.choice(KINDS))

    def reading_of(reading: Readings) -> Readings:
        rows = reading.rows
        if rows.kind != kind:
            return reading
        farthest = np.maximum.accumulate(rows.travel)
        slid = np.clip((farthest - onset) / 0.006, 0.0, 1.0)
        beads = reading.beads.copy()
        beads[:, bead] += slid[:, None] * slide
        return replace(reading, beads=beads)

    parameters: dict[str, object] = {
        "fiducial": bead,
        "slide": slide.tolist(),
        "onset_travel": onset,
        "experiment": kind,
    }
    return read_as(parameters, reading_of)


def _second_zero(random: Random, size: float, base: Mechanics) -> Drawn:
    share = float(random.uniform(0.25, 0.75))
    step = 0.08 * size * random.standard_normal(6) * np.array([1, 1, 1, 0.03, 0.03, 0.03])
    kind = str(random.choice(KINDS))

    def reading_of(reading: Readings) -> Readings:
        if reading.rows.kind != kind:
            return reading
        late = reading.rows.time > share * reading.rows.time[-1]
        return reading.with_sensed(reading.sensed() + np.outer(late, step))

    parameters: dict[str, object] = {
        "wrench_step": step.tolist(),
        "at_share_of_time": share,
        "experiment": kind,
    }
    return read_as(parameters, reading_of)


def _with_beads_of(reading: Readings, seen_s: FloatArray) -> Readings:
    """Return the readings with the beads where they were at other times (n,), s."""
    columns = reading.beads.reshape(len(seen_s), -1).T
    beads = np.column_stack([np.interp(seen_s, reading.rows.time, column) for column in columns])
    return replace(reading, beads=beads.reshape(reading.beads.shape))


def _late_vision(random: Random, size: float, base: Mechanics) -> Drawn:
    lag = 0.08 * size

    def reading_of(reading: Readings) -> Readings:
        return _with_beads_of(reading, reading.rows.time - lag)

    return read_as({"vision_lag": lag}, reading_of)


def _clipped_force(random: Random, size: float, base: Mechanics) -> Drawn:
    limit = base.law.youngs_modulus / 15e3 * 2.3 * float(np.clip(1 - 0.1 * size, 0.2, 0.99))

    def reading_of(reading: Readings) -> Readings:
        sensed = reading.sensed()
        sensed[:, 0] = np.clip(sensed[:, 0], -limit, limit)
        return reading.with_sensed(sensed)

    return read_as({"largest_force_x": limit}, reading_of)


def _stale_images(random: Random, size: float, base: Mechanics) -> Drawn:
    share = float(random.uniform(0.1, 0.3))
    age = 0.3 * size
    seed = int(random.integers(2**31))

    def reading_of(reading: Readings) -> Readings:
        time = reading.rows.time
        stale = np.random.default_rng([seed, reading.rows.order]).random(len(time)) < share
        return _with_beads_of(reading, np.where(stale, time - age, time))

    return read_as({"stale_share": share, "age": age}, reading_of)


_EFFECTS: dict[str, tuple[Draw, tuple[float, float]]] = {
    **outside_tissue.DRAWS,
    "lens_distortion": (_lens, (0.02, 8.0)),
    "refraction": (_refraction, (0.02, 6.0)),
    "jammed_wrist": (_jammed_wrist, (0.12, 3.8)),
    "creeping_camera": (_creeping_camera, (0.02, 8.0)),
    "shaking_camera": (_shaking_camera, (0.1, 8.0)),
    "stale_images": (_stale_images, (0.02, 8.0)),
    "cable": (_cable, (0.02, 12.0)),
    "loose_bead": (_loose_bead, (0.05, 6.0)),
    "second_zero": (_second_zero, (0.02, 8.0)),
    "late_vision": (_late_vision, (0.05, 6.0)),
    "clipped_force": (_clipped_force, (0.1, 8.0)),
}

# What the diagnosis has a form for, though no label; these it has not.
_FAR = frozenset(("shaking_camera", "stale_images", "tearing"))
_OF_BLOCKS = frozenset(("air_pocket", "cut", "sticky_patch", "tearing"))
_OF_BEADS = frozenset(
    (
        "creeping_camera",
        "late_vision",
        "lens_distortion",
        "loose_bead",
        "refraction",
        "shaking_camera",
        "stale_images",
    )
)

_BLOCKS: dict[str, str] = {
    **dict.fromkeys(("cut", "tearing", "warming"), "interior"),
    **dict.fromkeys(("sticky_patch", "air_pocket"), "support"),
    **dict.fromkeys(
        ("lens_distortion", "refraction", "creeping_camera", "shaking_camera", "loose_bead"), "vision"
    ),
    **dict.fromkeys(("stale_images", "late_vision"), "timing"),
    **dict.fromkeys(("cable", "second_zero", "clipped_force"), "force"),
    "thermal_shrinkage": "geometry",
    "jammed_wrist": "robot",
}

FORMS: dict[str, Form] = {
    name: Form(
        name,
        draw,
        limits,
        family="far" if name in _FAR else "exact",
        block=name in _OF_BLOCKS,
        beads=int(name in _OF_BEADS),
        acts_on=_BLOCKS[name],
    )
    for name, (draw, limits) in _EFFECTS.items()
}
