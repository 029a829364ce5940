"""The work that the gripper does: a body at rest gives none that was not put into it.

From a state of rest, whatever is done to a passive body, elastic or not, the work that has been done on it is never
below zero: it is what the body has stored and what it has turned into heat (Coleman, Arch. Ration. Mech. Anal. 17,
1964). With the force F that the tissue exerts on the gripper that is minus the integral of F dx along the path. Only
gravity can add to it, and not more than the body's weight times its travel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.experiment.holds import FloatArray
from estimator.experiment.model import Experiment
from estimator.experiment.observations import WRENCH_COLUMNS
from estimator.experiment_checks.finding import Finding, of_rows
from estimator.experiment_checks.readings import SURELY, at_rest, body_box, rotation_vectors, travel

_SMALL_TURN = np.radians(5.0)
_UNSEEN_TRAVEL = 0.05  # of the travel, along axes whose force was not measured
_AGAINST = 0.5  # of what the same forces would do if they all opposed the motion
_RETURNED = 0.05  # of the farthest travel


@dataclass(frozen=True, slots=True, eq=False)
class Work:
    """Work on the body up to each row.

    Attributes
    ----------
    along : (n, k) J, of each component that was measured, its row by row
    columns : names of the components
    noise : (n,) J, standard deviation of their sum
    gravity : (n,) J, the most that the body's weight can have given
    """

    along: FloatArray
    columns: tuple[str, ...]
    noise: FloatArray
    gravity: FloatArray

    @property
    def total(self) -> FloatArray:
        """Sum over the components, (n,), J."""
        return self.along.sum(axis=1)

    @property
    def surely_negative(self) -> NDArray[np.bool_]:
        """Tell where the sum is below what noise and weight can explain, (n,)."""
        return self.total < -(SURELY * self.noise + self.gravity)


def work_on_body(experiment: Experiment) -> Work | None:
    """Return the work, with forces counted from the rows at rest; None where what was measured does not tell it.

    That is so where the gripper moves along an axis, or turns about one, whose force or torque is not measured, and
    where the experiment begins under load, with energy stored.
    """
    if experiment.first_row == "under_load":
        return None
    moved, turned = travel(experiment), rotation_vectors(experiment)
    motion = np.column_stack([moved, turned])
    rest = at_rest(experiment)
    wrench = experiment.wrench
    known = np.asarray(np.isfinite(wrench).all(axis=0))
    if not known[:3].any():
        return None
    distance = float(np.abs(moved).max())
    if np.any(np.abs(moved).max(axis=0)[~known[:3]] > _UNSEEN_TRAVEL * distance):
        return None
    turns = float(np.abs(turned).max()) > _SMALL_TURN
    if turns and not known[3:].all():
        return None
    used = known.copy()
    used[3:] &= turns
    forces = np.where(used, wrench - np.where(used, wrench[rest].mean(axis=0), 0.0), 0.0)
    steps = np.diff(motion, axis=0)
    mean = (forces[1:] + forces[:-1]) / 2
    along = np.vstack([np.zeros(6), np.cumsum(-mean * steps, axis=0)])
    sensor = experiment.sensor
    scatter = np.repeat([sensor.force_std, sensor.torque_std], 3) * used
    places = np.repeat([sensor.position_std, 0.0], 3) * used
    # the zero is known as well as its rows tell; its error does work over the whole way
    zero = (np.abs(motion) * scatter / np.sqrt(max(int(rest.sum()), 1))).sum(axis=1)
    readings = np.cumsum((steps * scatter) ** 2 + (mean * places * np.sqrt(2)) ** 2, axis=0).sum(axis=1)
    noise = np.hypot(zero, np.concatenate([[0.0], np.sqrt(readings)]))
    edges = np.subtract(body_box(experiment).upper, body_box(experiment).lower)
    weight = float(np.prod(edges)) * experiment.phantom.density
    gravity = weight * np.abs(moved @ np.asarray(experiment.environment.gravity))
    return Work(along[:, used], tuple(np.array(WRENCH_COLUMNS)[used]), noise, gravity)


def check_work(experiment: Experiment) -> list[Finding]:
    """Work on a body from rest is never negative; where it is, a sign, a clock or a zero is not right.

    A force that pushes along the motion throughout has the wrong sign. One that gives back more than it took may be
    late or drift, which a diagnosis can name: that is suspicious.
    """
    work = work_on_body(experiment)
    if work is None or not work.surely_negative.any():
        return []
    row = int(np.argmin(work.total + SURELY * work.noise + work.gravity))
    lost = -work.total[row]
    distance = np.linalg.norm(travel(experiment), axis=1)
    effort = float(np.abs(np.diff(work.along, axis=0, prepend=0.0))[: row + 1].sum())
    worst = work.columns[int(np.argmin(work.along[row]))]
    if lost > _AGAINST * effort:
        what = f"the force pushes along the motion: the tissue has done {lost:.3g} J on the gripper by here"
        do = f"write the force of the tissue on the gripper; turn the sign of {_signs(work, row)} over"
        return [of_rows("wrong", "sign of forces", what, do, row=row, column=worst)]
    if distance[row] < _RETURNED * distance.max():
        what = f"over a closed path from rest the tissue puts out {lost:.3g} J, which no passive body does"
        do = "check that force and position are of one clock, and that the force keeps its zero"
        return [of_rows("suspicious", "energy", what, do, row=row, column=worst)]
    what = f"the tissue has put out {lost:.3g} J more than was put into it, which no passive body does"
    do = f"check the sign of {worst}, the clocks of force and position, and that the force keeps its zero"
    return [of_rows("suspicious", "energy", what, do, row=row, column=worst)]


def check_signs_of_axes(experiment: Experiment) -> list[Finding]:
    """Along an axis that the gripper surely moves along, most of the work is done against the tissue."""
    work = work_on_body(experiment)
    if work is None or work.surely_negative.any():
        return []
    findings = []
    for place, column in enumerate(work.columns[:3]):
        if column not in WRENCH_COLUMNS[:3]:
            continue
        lowest = int(np.argmin(work.along[:, place]))
        lost = -work.along[lowest, place]
        largest = float(np.abs(work.along).max())
        if lost > SURELY * work.noise[lowest] + work.gravity[lowest] and lost > 0.3 * largest:
            what = f"this component gives {lost:.3g} J to the gripper, and the others take {largest:.3g} J from it"
            do = f"check the sign of {column}"
            findings.append(of_rows("suspicious", "sign of forces", what, do, row=lowest, column=column))
    return findings


def _signs(work: Work, row: int) -> str:
    negative = [name for name, value in zip(work.columns, work.along[row], strict=True) if value < 0]
    return ", ".join(negative)
