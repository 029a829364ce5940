"""How much of what a form of the maker does the catalogue's forms of the same label can do, whatever their parameters.

The measure is the length in standard deviations of the noise that is left, as a share of the whole, both without what a
change of E and ν imitates. Where a form acts on the tissue the lengths are those of a course instead: of the gripper's
true pose, of a stress that relaxes, or of the logarithm of the modulus over the sheet.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from blind_scenes import BASELINE, BEADS, COARSE, drawn
from numpy.typing import NDArray
from scipy.optimize import least_squares

from estimator.blind.making.scenes.retraction import KINDS, Manner, Rows, rows_of
from estimator.blind.making.scenes.scene import Form, Mechanics, Readings, Scene
from estimator.blind.making.scenes.setup import SENSOR, Setup
from estimator.blind.making.scenes.simulate import carry_out, read
from estimator.blind.making.scenes.stated import experiments_of
from estimator.effects.catalogue import default_catalogue
from estimator.effects.effect import Effect, Motion, Values
from estimator.effects.effect import Readings as Predicted
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]
Change = Callable[[Values], FloatArray]

ROWS: tuple[Rows, ...] = tuple(rows_of(kind, order, Manner()) for order, kind in enumerate(KINDS, start=1))
_SETUP = Setup(BASELINE, KINDS, Manner(), BEADS, "standard", "P1")
_ARM_M = 0.03
_EVALUATIONS = 60


@cache
def _true(poisson_ratio: float) -> tuple[Readings, ...]:
    mechanics = replace(BASELINE, law=replace(BASELINE.law, poisson_ratio=poisson_ratio))
    return read(Scene(mechanics), carry_out(mechanics, ROWS, BEADS, COARSE))


def left_of_readings(label: str, form: Form, size: float = 1.0) -> float:
    """Return the share that the catalogue's forms of the instruments leave of a form that acts on these alone."""
    true = _true(BASELINE.law.poisson_ratio)
    scene = drawn(form, size).change(Scene(BASELINE))
    seen = [_read(scene, reading) for reading in true]
    aside = _imitable()
    gap = _apart(aside, _channels(seen) - _channels(true))
    experiments = _experiments(tuple(seen))
    predicted = [_predicted(*pair) for pair in zip(experiments, true, strict=True)]

    def change_by(effect: Effect) -> Change:
        def change(values: Values) -> FloatArray:
            changed = [effect.readings(one, values) for one in predicted]
            parts = [
                _scaled(new.wrench - old.wrench, _since_rest(new) - _since_rest(old))
                for new, old in zip(changed, predicted, strict=True)
            ]
            return _apart(aside, np.concatenate(parts))

        return change

    effects = [one for one in default_catalogue().forms(label) if not one.acts_on_tissue]
    return min(_least(gap, effect, change_by(effect), predicted) for effect in effects)


def left_of_motion(label: str, form: Form, size: float = 1.0) -> float:
    """Return the share that the catalogue's forms leave of the gripper's true pose, a radian counted as 30 mm."""
    change = drawn(form, size).change(Scene(BASELINE)).mechanics.motion[-1]
    experiments = _experiments(_true(BASELINE.law.poisson_ratio))
    motions = [
        Motion(one, rows.position, rows.rotation, reading.wrench, reading.wrench, rows.time)
        for one, rows, reading in zip(experiments, ROWS, _true(BASELINE.law.poisson_ratio), strict=True)
    ]
    gap = np.concatenate([_pose_change(change(rows), rows) for rows in ROWS])

    def change_by(effect: Effect) -> Change:
        return lambda values: np.concatenate(
            [
                _pose_change(effect.motion(motion, values), rows)
                for motion, rows in zip(motions, ROWS, strict=True)
            ]
        )

    effects = default_catalogue().forms(label)
    return min(_least(gap, effect, change_by(effect), ()) for effect in effects)


def _pose_change(moved: Motion | Rows, rows: Rows) -> FloatArray:
    turned = (moved.rotation * rows.rotation.inv()).as_rotvec()
    return np.concatenate([(moved.position - rows.position).ravel(), _ARM_M * turned.ravel()])


def left_of_relaxation(form: Form, size: float = 1.0) -> float:
    """Return the share that two relaxing terms leave of the overstress of a spring stretched as the gripper moves."""
    relaxation = drawn(form, size).change(Scene(BASELINE)).mechanics.relaxation
    assert relaxation is not None
    spring = np.concatenate([rows.travel for rows in ROWS])
    aside = np.linalg.qr(spring[:, None])[0]
    whole = sum(
        share * _overstress(time) for share, time in zip(relaxation.shares, relaxation.times, strict=True)
    )
    gap = _apart(aside, np.asarray(whole))

    def misfit(log_times: FloatArray) -> FloatArray:
        basis = np.column_stack([_apart(aside, _overstress(float(np.exp(one)))) for one in log_times])
        return gap - basis @ np.linalg.lstsq(basis, gap, rcond=None)[0]

    starts = [(np.log(a), np.log(b)) for a, b in ((1.0, 10.0), (2.0, 30.0), (0.5, 100.0), (5.0, 20.0))]
    found = [least_squares(misfit, start, bounds=(np.log(0.1), np.log(1000.0))) for start in starts]
    return min(float(np.sqrt(2 * one.cost)) for one in found) / float(np.linalg.norm(gap))


def _overstress(time_s: float) -> FloatArray:
    """Return the stress (n,) of a Maxwell element of unit stiffness, stretched by the gripper's travel."""
    parts = []
    for rows in ROWS:
        stress = [0.0]
        for step, moved in zip(np.diff(rows.time) / time_s, np.diff(rows.travel), strict=True):
            stress.append(stress[-1] * float(np.exp(-step)) - float(np.expm1(-step) / step) * moved)
        parts.append(np.array(stress))
    return np.concatenate(parts)


def left_of_places(label: str, form: Form, size: float = 1.0) -> float:
    """Return the share that the catalogue's regions, or gradients, leave of the logarithm of the modulus."""
    x, y, z = np.meshgrid(
        np.linspace(-0.049, 0.049, 50), np.linspace(-0.049, 0.049, 50), [-0.0035, 0.0, 0.0035]
    )
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    mechanics: Mechanics = drawn(form, size).change(Scene(BASELINE)).mechanics
    log_modulus = np.log(np.prod([factor(points) for factor in mechanics.stiffness], axis=0))
    aside = np.full((len(points), 1), len(points) ** -0.5)
    gap = _apart(aside, log_modulus)
    if label == "modulus_gradient":
        bases: list[Callable[[FloatArray], FloatArray]] = [
            lambda p: points @ p,
            lambda p: np.log1p(np.clip(points @ p, -0.95, 9)),
        ]
        starts = [np.zeros(3) + 0.1]
    else:
        bases = [lambda p: _disc(points, p, 2), lambda p: _disc(points, p, 3)]
        centres = np.linspace(-0.03, 0.03, 5)
        starts = [np.array([a, b, r]) for a in centres for b in centres for r in (0.008, 0.014)]
    best = np.inf
    for basis in bases:
        for start in starts:
            if label == "modulus_gradient":
                found = least_squares(lambda p, basis=basis: gap - _apart(aside, basis(p)), start)
            else:
                found = least_squares(
                    lambda p, basis=basis: _without(gap, _apart(aside, basis(p))), start, x_scale=0.01
                )
            best = min(best, float(np.sqrt(2 * found.cost)))
    return best / float(np.linalg.norm(gap))


def _disc(points: FloatArray, place: FloatArray, axes: int) -> FloatArray:
    centre = np.array([place[0], place[1], 0.0])
    away = np.linalg.norm((points - centre)[:, :axes], axis=1)
    return np.asarray((1 + np.tanh((abs(place[2]) - away) / 0.001)) / 2)


def _without(gap: FloatArray, column: FloatArray) -> FloatArray:
    return gap - column * (column @ gap) / max(float(column @ column), 1e-12)


def _least(gap: FloatArray, effect: Effect, change: Change, predicted: Sequence[Predicted]) -> float:
    """Return the smallest share of a gap that an effect leaves, from each of its starts."""
    free = [constant for constant in effect.constants if not constant.fixed]
    names = [*(a.name for a in effect.amplitudes), *(c.name for c in free)]
    scale = np.array(
        [*(a.scale for a in effect.amplitudes), *(max(abs(c.upper - c.lower) / 20, 1e-6) for c in free)]
    )
    lower = np.array([*(a.lower for a in effect.amplitudes), *(c.lower for c in free)]) / scale
    upper = np.array([*(a.upper for a in effect.amplitudes), *(c.upper for c in free)]) / scale
    whole, best = float(np.linalg.norm(gap)), 1.0
    starts = effect.starts(predicted) if effect.constants else [{}]
    for start in starts:
        fixed = {name: value for name, value in start.items() if name not in names}

        def misfit(place: FloatArray, fixed: dict[str, float] = fixed) -> FloatArray:
            values = {**fixed, **dict(zip(names, (place * scale).tolist(), strict=True))}
            return (gap - change(values)) / whole

        at = np.array([*(0.05 for _ in effect.amplitudes), *(start[c.name] for c in free)])
        at[len(effect.amplitudes) :] /= scale[len(effect.amplitudes) :]
        at = np.clip(at, lower + 1e-9, upper - 1e-9)
        found = least_squares(misfit, at, bounds=(lower, upper), max_nfev=_EVALUATIONS)
        best = min(best, float(np.sqrt(2 * found.cost)))
    return best


def _read(scene: Scene, reading: Readings) -> Readings:
    for distort in scene.readings:
        reading = distort(reading)
    return reading


@cache
def _imitable() -> FloatArray:
    true = _true(BASELINE.law.poisson_ratio)
    softer = _channels(_true(BASELINE.law.poisson_ratio - 0.004)) - _channels(true)
    by_modulus = np.concatenate([_scaled(one.wrench, np.zeros_like(one.beads)) for one in true])
    return np.linalg.qr(np.column_stack([softer, by_modulus]))[0]


def _apart(aside: FloatArray, change: FloatArray) -> FloatArray:
    return change - aside @ (aside.T @ change)


def _channels(readings: Sequence[Readings]) -> FloatArray:
    return np.concatenate([_scaled(one.wrench, one.beads - BEADS) for one in readings])


def _since_rest(readings: Predicted) -> FloatArray:
    return readings.fiducials - BEADS


def _scaled(wrench: FloatArray, beads: FloatArray) -> FloatArray:
    return np.concatenate([(wrench / SENSOR.wrench_std).ravel(), (beads / SENSOR.fiducial_std).ravel()])


def _experiments(readings: tuple[Readings, ...]) -> tuple[Experiment, ...]:
    """Return experiments that state readings free of noise."""
    made = experiments_of(_SETUP, Scene(BASELINE), readings, np.random.default_rng(0))
    return tuple(
        replace(one, position=reading.rows.position, wrench=reading.wrench, fiducials=reading.beads)
        for one, reading in zip(made, readings, strict=True)
    )


def _predicted(experiment: Experiment, true: Readings) -> Predicted:
    rows = true.rows
    return Predicted(
        experiment,
        rows.position,
        rows.rotation,
        rows.position,
        true.wrench,
        true.beads,
        true.wrench[0],
        true.beads[0],
    )
