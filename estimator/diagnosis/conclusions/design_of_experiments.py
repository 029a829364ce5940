"""Which manoeuvre would tell apart the causes that remain.

The distance of two causes is the length, in standard deviations, of what is left of one's signature once the other and
the nuisances have taken all they can of it (Box & Hill 1967 for the choice of the next experiment). It
is computed for the data at hand and with the rows that a manoeuvre would add.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.diagnosis.conclusions.open_questions import measurements
from estimator.diagnosis.conclusions.rehearsal import Rehearsal, rehearsed
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.fitting.case import Linearisation
from estimator.diagnosis.result import Advice, Manoeuvre
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.screening import Trial
from estimator.diagnosis.settings import ConclusionSettings
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]


MANOEUVRES: tuple[Manoeuvre, ...] = (
    Manoeuvre("lift the gripper by 12 mm, hold 30 s and return", (0.0, 0.0, 0.012), (0.0, 0.0, 0.0)),
    Manoeuvre("pull sideways by 12 mm, hold 30 s and return", (0.0, 0.012, 0.0), (0.0, 0.0, 0.0)),
    Manoeuvre(
        "turn the gripper by 20° in the plane, hold 30 s and return", (0.0, 0.0, 0.0), (0.0, 0.0, 0.35)
    ),
)


def advise(
    context: Context, trials: Mapping[str, Trial], probability: Mapping[str, float]
) -> tuple[Advice, ...]:
    """Return for each pair of leading causes the manoeuvre that would separate them best."""
    case, baseline, settings = context.case, context.baseline, context.settings.conclusions
    leading = [label for label in probability if label in trials][: settings.causes_to_part]
    pairs = [
        (one, other, _distance(baseline, trials[one].signature, trials[other].signature, []))
        for one, other in combinations(leading, 2)
    ]
    close = [pair for pair in pairs if pair[2] < settings.apart]
    needed = {label for one, other, _ in close for label in (one, other)}
    plans = [(trials[label].signature.effect, trials[label].signature.constants) for label in needed]
    jobs = [
        context.executor.submit(
            rehearsed, case, baseline.hypothesis, _planned(case.experiments[-1], manoeuvre, settings), plans
        )
        for manoeuvre in MANOEUVRES
        if close
    ]
    rehearsals = [job.result() for job in jobs]
    context.tell("choosing the next experiment", 1, 1)
    found, measured_by = [], measurements(context.catalogue)
    for one, other, now in close:
        options = [
            Advice(
                manoeuvre.words,
                (one, other),
                now,
                _with_manoeuvre(baseline, trials, needed, one, other, rehearsal),
                manoeuvre,
            )
            for manoeuvre, rehearsal in zip(MANOEUVRES, rehearsals, strict=True)
            if rehearsal is not None
        ]
        best = max(options, key=_gain, default=None)
        if best is None or _gain(best) < now:
            # No motion of the gripper helps much. What a measurement beside the rig would add is not rehearsed.
            words = [measured_by[label] for label in (one, other) if label in measured_by]
            best = Advice(words[0], (one, other), now, float("nan")) if words else best
        if best is not None:
            found.append(best)
    return tuple(sorted(found, key=lambda advice: -np.nan_to_num(_gain(advice))))


def _gain(advice: Advice) -> float:
    return advice.sigma_then - advice.sigma_now


def _with_manoeuvre(
    baseline: Linearisation,
    trials: Mapping[str, Trial],
    needed: set[str],
    one: str,
    other: str,
    rehearsal: Rehearsal,
) -> float:
    of_label = dict(zip(needed, rehearsal.signatures, strict=True))
    more = [(rehearsal.by_material, of_label[one].columns[0], of_label[other].columns[0])]
    return _distance(baseline, trials[one].signature, trials[other].signature, more)


def _distance(
    baseline: Linearisation,
    one: Signature,
    other: Signature,
    more: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
) -> float:
    """Return the distance between one cause at its fitted size and anything the other can do."""
    blocks = [
        *zip(baseline.jacobian, one.columns, other.columns, strict=True),
        *more,
    ]
    size = _fitted(baseline, one)
    target = np.concatenate([columns @ size for _, columns, _ in blocks])
    nuisance = np.concatenate([np.column_stack([material, rival]) for material, _, rival in blocks])
    scale = np.linalg.norm(nuisance, axis=0)
    nuisance = nuisance / np.where(scale > 0, scale, 1.0)
    left = target - nuisance @ np.linalg.lstsq(nuisance, target, rcond=1e-8)[0]
    return float(np.linalg.norm(left))


def _fitted(baseline: Linearisation, signature: Signature) -> FloatArray:
    columns = np.concatenate(
        [np.column_stack(pair) for pair in zip(baseline.jacobian, signature.columns, strict=True)]
    )
    scale = np.linalg.norm(columns, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    solution = np.linalg.lstsq(columns / scale, np.concatenate(baseline.residual), rcond=1e-8)[0]
    return np.asarray((solution / scale)[baseline.jacobian[0].shape[1] :])


def _planned(last: Experiment, manoeuvre: Manoeuvre, settings: ConclusionSettings) -> Experiment:
    """Return the manoeuvre as an experiment that follows the last one."""
    steps = settings.manoeuvre_steps
    out = np.arange(steps + 1) / steps
    share = np.concatenate([out, [1.0], out[-2::-1]])
    seconds = np.full(len(share), settings.manoeuvre_step_s)
    seconds[0], seconds[steps + 1] = 0.0, settings.manoeuvre_hold_s
    phase = ("hold", *["ramp"] * steps, "hold", *["return"] * steps)
    turn = Rotation.from_rotvec(np.outer(share, manoeuvre.turn_rad))
    position = np.asarray(last.grasp.centre) + np.outer(share, manoeuvre.offset_m)
    return replace(
        last,
        name=manoeuvre.words,
        order=last.order + 1,
        trajectory_kind="other",
        time=np.cumsum(seconds),
        phase=phase,
        step=np.arange(len(share)),
        position=position,
        quaternion_wxyz=turn.as_quat(scalar_first=True),
        wrench=np.zeros((len(share), 6)),
        fiducials=np.broadcast_to(last.fiducials_rest, (len(share), *last.fiducials_rest.shape)).copy(),
        path=None,
    )
