"""How much of what a form of the maker does the catalogue's forms of the same label can do, whatever their parameters.

The measure is the length in standard deviations of the noise that is left, as a share of the whole, both without what a
change of E and ν imitates. Where a form acts on the tissue the lengths are those of a course instead: of the gripper's
true pose, or of a stress that relaxes.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from blind_scenes import BASELINE, BEADS, COARSE, drawn
from numpy.typing import NDArray
from scipy.optimize import least_squares

from estimator.blind.making.scenes.retraction import KINDS, Manner, Rows, rows_of
from estimator.blind.making.scenes.scene import Form, Readings, Scene
from estimator.blind.making.scenes.setup import SENSOR, Setup
from estimator.blind.making.scenes.simulate import carry_out, read
from estimator.blind.making.scenes.stated import experiments_of
from estimator.effects.catalogue import default_catalogue
from estimator.effects.effect import Effect, Motion, Values
from estimator.effects.effect import Readings as Predicted
from estimator.experiment import Experiment
from estimator.inference.free_parameter import IDENTITY, LOGARITHM

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


def left_of_readings(label: str, form: Form, size: float = 1.0, seed: int = 3) -> float:
    """Return the share that the catalogue's forms of the instruments leave of a form that acts on these alone."""
    true = _true(BASELINE.law.poisson_ratio)
    scene = drawn(form, size, seed).change(Scene(BASELINE))
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


def left_of_motion(label: str, form: Form, size: float = 1.0, seed: int = 3) -> float:
    """Return the share that the catalogue's forms leave of the gripper's true pose, a radian counted as 30 mm."""
    change = drawn(form, size, seed).change(Scene(BASELINE)).mechanics.motion[-1]
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


def left_of_relaxation(form: Form, size: float = 1.0, seed: int = 3) -> float:
    """Return the share that two relaxing terms leave of the overstress of a spring stretched as the gripper moves."""
    relaxation = drawn(form, size, seed).change(Scene(BASELINE)).mechanics.relaxation
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


def _least(gap: FloatArray, effect: Effect, change: Change, predicted: Sequence[Predicted]) -> float:
    """Return the smallest share of a gap that an effect leaves, from each of its starts."""
    starts = effect.starts(predicted) if effect.constants else [{}]
    least = _least_linear if effect.linear else _least_nonlinear
    return min(least(gap, effect, change, start) for start in starts) / float(np.linalg.norm(gap))


def _least_linear(gap: FloatArray, effect: Effect, change: Change, start: Values) -> float:
    """Return the length that is left of a gap by the best amplitudes, and the best constants near their start."""
    free = [constant for constant in effect.constants if not constant.fixed]

    scales = [LOGARITHM if one.lower > 0.0 else IDENTITY for one in free]

    def misfit(place: FloatArray) -> FloatArray:
        moved = zip(free, scales, place, strict=True)
        constants = {**start, **{one.name: scale.value_of(float(x)) for one, scale, x in moved}}
        none = {one.name: 0.0 for one in effect.amplitudes}
        columns = [change({**constants, **none, one.name: one.scale}) for one in effect.amplitudes]
        basis = np.column_stack(columns)
        return gap - basis @ np.linalg.lstsq(basis, gap, rcond=None)[0]

    if not free:
        return float(np.linalg.norm(misfit(np.zeros(0))))
    both = list(zip(free, scales, strict=True))
    at = [scale.internal_of(start[one.name]) for one, scale in both]
    lower, upper = (
        [scale.internal_of(getattr(one, end)) for one, scale in both] for end in ("lower", "upper")
    )
    return float(np.sqrt(2 * least_squares(misfit, at, bounds=(lower, upper), max_nfev=12).cost))


def _least_nonlinear(gap: FloatArray, effect: Effect, change: Change, start: Values) -> float:
    """Return the length that is left of a gap by the best amplitudes beside constants that stay."""
    names = [one.name for one in effect.amplitudes]
    scale = np.array([one.scale for one in effect.amplitudes])
    bounds = (
        np.array([getattr(one, side) for one in effect.amplitudes]) / scale for side in ("lower", "upper")
    )

    def misfit(place: FloatArray) -> FloatArray:
        return gap - change({**start, **dict(zip(names, (place * scale).tolist(), strict=True))})

    at = np.full(len(names), 0.05)
    return float(np.sqrt(2 * least_squares(misfit, at, bounds=tuple(bounds), max_nfev=_EVALUATIONS).cost))


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
