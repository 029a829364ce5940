"""Forces that cannot be: one before any motion, one that does not know which way, one column that is another."""

from itertools import combinations

import numpy as np

from estimator.experiment.model import Experiment
from estimator.experiment.observations import WRENCH_COLUMNS
from estimator.experiment_checks.finding import Finding, of_facts, of_rows
from estimator.experiment_checks.readings import SURELY, at_rest, travel

_FEWEST = 5
_OF_LARGEST = 0.05
_BOTH_WAYS = 0.2
_LARGEST = {"N": 400.0, "N·m": 20.0}  # the largest range of the laboratory's sensors


def check_before_motion(experiment: Experiment) -> list[Finding]:
    """Before any motion there is no force: the experiment begins at rest, and the sensor was zeroed there.

    Absolute forces of a phantom that hangs may be anything. A mean of n rows is judged by its own scatter; an offset
    below a twentieth of the largest force is left to the fit.
    """
    if experiment.environment.weight == "acts" and experiment.sensor.force_zero == "no_load":
        return []
    rest = at_rest(experiment)
    findings = []
    for kind, std, unit in (
        (range(3), experiment.sensor.force_std, "N"),
        (range(3, 6), experiment.sensor.torque_std, "N·m"),
    ):
        values = experiment.wrench[:, list(kind)]
        if not np.isfinite(values).any():
            continue
        largest = float(np.nanmax(np.abs(values)))
        off = []
        for axis, series in zip(kind, values.T, strict=True):
            before = series[rest & np.isfinite(series)]
            if not len(before) or not np.isfinite(series[~rest]).any():
                continue
            mean = float(before.mean())
            if abs(mean) > max(SURELY * std / np.sqrt(len(before)), _OF_LARGEST * largest):
                off.append((WRENCH_COLUMNS[axis], mean))
        if off:
            means = ", ".join(f"{column} {mean:.3g}" for column, mean in off)
            what = f"{means} {unit} before any motion, of {largest:.3g} {unit} at most"
            do = "zero the sensor at rest; if the body is under load there, say so: first_row, weight, force_zero"
            findings.append(of_rows("suspicious", "force before motion", what, do, row=0, column=off[0][0]))
    return findings


def check_sizes_of_forces(experiment: Experiment) -> list[Finding]:
    """No soft tissue bears more than the largest sensor of a laboratory reads."""
    findings = []
    for kind, unit in ((slice(0, 3), "N"), (slice(3, 6), "N·m")):
        values = np.abs(experiment.wrench[:, kind])
        beyond = np.argwhere(values > _LARGEST[unit])
        if len(beyond):
            row, axis = beyond[0]
            what = (
                f"{values[row, axis]:.4g} {unit}, more than any soft tissue bears; {len(beyond)} values are"
            )
            column = WRENCH_COLUMNS[kind][axis]
            findings.append(
                of_rows("wrong", "size of forces", what, f"write {unit}", row=int(row), column=column)
            )
    return findings


def check_same_columns(experiment: Experiment) -> list[Finding]:
    """Two components are not the same numbers: each has noise of its own."""
    findings = []
    for one, other in combinations(range(6), 2):
        a, b = experiment.wrench[:, one], experiment.wrench[:, other]
        known = np.isfinite(a) & np.isfinite(b)
        if known.sum() < _FEWEST or np.ptp(a[known]) == 0:
            continue
        for sign, words in ((1, "the same numbers as"), (-1, "the negative of")):
            if np.array_equal(a[known], sign * b[known]):
                what = f"{words} {WRENCH_COLUMNS[one]}"
                do = "take each component from its own channel; leave empty what was not measured"
                findings.append(of_rows("wrong", "same columns", what, do, column=WRENCH_COLUMNS[other]))
    return findings


def check_both_ways(experiment: Experiment) -> list[Finding]:
    """A force changes its sign when the gripper goes to the other side of rest; a magnitude does not."""
    moved = travel(experiment)
    findings = []
    for axis in range(3):
        way, force = moved[:, axis], experiment.wrench[:, axis]
        known = np.isfinite(force)
        way, force = way[known], force[known]
        if len(way) < _FEWEST:
            continue
        reach = float(np.abs(way).max())
        ahead, behind = way > _BOTH_WAYS * reach, way < -_BOTH_WAYS * reach
        # along the axis of the motion alone does an elastic body have to answer both ways
        if reach < 0.9 * np.abs(moved).max() or min(ahead.sum(), behind.sum()) < 2:
            continue
        least = SURELY * experiment.sensor.force_std
        if (force[ahead].min() > least and force[behind].min() > least) or (
            force[ahead].max() < -least and force[behind].max() < -least
        ):
            what = "has one sign on both sides of rest, as a magnitude has"
            do = "export the component with its sign"
            findings.append(of_rows("wrong", "sign of forces", what, do, column=WRENCH_COLUMNS[axis]))
    return findings


def check_given_loads(experiment: Experiment) -> list[Finding]:
    """A sensor's force scatters while the gripper stands; a load that was hung is known, and the pose is what scatters.

    Told where every force stays what it is within every step, while the reported position does not.
    """
    forces = experiment.wrench[:, :3]
    same = np.diff(experiment.step) == 0
    if experiment.driven == "load" or not same.any() or not np.nanmax(np.abs(forces), initial=0.0) > 0:
        return []
    still = np.nan_to_num(np.diff(forces, axis=0)[same]) == 0
    scatter = np.diff(experiment.position, axis=0)[same].any(axis=1)
    if not still.all() or not scatter.all():
        return []
    what = "the forces are to the last digit the same within a step, and the pose is not: as of a known load that hangs"
    do = 'if the gripper is free and carries it, write driven = "load" and orientation_std in retraction-experiment/2'
    return [of_facts("suspicious", "given loads", what, do, "[trajectory] driven")]
