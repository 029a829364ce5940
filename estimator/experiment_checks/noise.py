"""Noise: every measured column has some, and about as much as [sensor] states."""

from collections.abc import Iterator

import numpy as np

from estimator.experiment.holds import FloatArray
from estimator.experiment.model import Experiment
from estimator.experiment.observations import WRENCH_COLUMNS, fiducial_columns
from estimator.experiment_checks.finding import Finding, of_facts, of_rows
from estimator.experiment_checks.readings import at_rest, longest_edge

_FEWEST_ROWS = 3
_FEWEST_DIFFERENCES = 6
_TOO_MUCH = 5.0
_TOO_LITTLE = 0.1


def check_constant(experiment: Experiment) -> list[Finding]:
    """A sensor that measures gives other last digits from row to row; a column that never changes was not measured."""
    constant: dict[str, list[tuple[str, float]]] = {}
    for channel, columns, values in _channels(experiment):
        for column, series in zip(columns, values.T, strict=True):
            known = series[np.isfinite(series)]
            if len(known) >= _FEWEST_ROWS and np.ptp(known) == 0:
                constant.setdefault(channel, []).append((column, float(known[0])))
    findings = []
    for named in constant.values():
        column, value = named[0]
        more = f", as {len(named) - 1} more of its kind" if len(named) > 1 else ""
        what = f"is {value:g} in every row{more}"
        do = "if it was not measured, leave its fields empty; if it is known, keep it"
        findings.append(of_rows("suspicious", "constant column", what, do, column=column))
    return findings


def check_measured(experiment: Experiment) -> list[Finding]:
    """Something is measured: forces, or beads."""
    if np.isnan(experiment.wrench[1:]).all() and np.isnan(experiment.fiducials[1:]).all():
        what = "neither a force nor a bead is given after the first row"
        return [of_rows("wrong", "what is measured", what, "export the measurements too")]
    return []


def not_measured(experiment: Experiment) -> list[Finding]:
    """Tell which columns hold no measurement, or only one in the first row."""
    findings = []
    for channel, columns, values in _channels(experiment):
        empty = [
            column
            for column, series in zip(columns, values.T, strict=True)
            if not np.isfinite(series[1:]).any()
        ]
        if empty:
            shown = ", ".join(empty[:6]) + (f" and {len(empty) - 6} more" if len(empty) > 6 else "")
            what = f"{channel}: {shown} not measured"
            findings.append(of_rows("fine", "what is measured", what, "", column=empty[0]))
    return findings


def check_stated_noise(experiment: Experiment) -> list[Finding]:
    """What [sensor] states is above zero, and below what would hide everything."""
    sensor, longest = experiment.sensor, longest_edge(experiment)
    findings = []
    for name, unit in (
        ("force_std", "N"),
        ("torque_std", "N·m"),
        ("fiducial_std", "m"),
        ("position_std", "m"),
    ):
        std = float(getattr(sensor, name))
        if not std > 0:
            what = f"is {std:g} {unit}: no sensor is without noise"
            do = "state the standard deviation of one value"
            findings.append(of_facts("wrong", "stated noise", what, do, f"[sensor] {name}"))
        elif unit == "m" and std > 0.1 * longest:
            what = f"is {std:g} m on a phantom of {longest:g} m"
            findings.append(of_facts("wrong", "stated noise", what, "write metres", f"[sensor] {name}"))
    if experiment.driven == "load":
        return findings  # the load is known, and may be none
    for values, name, unit in (
        (experiment.wrench[:, :3], "force_std", "N"),
        (experiment.wrench[:, 3:], "torque_std", "N·m"),
    ):
        largest = float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 0.0
        std = float(getattr(sensor, name))
        if std > largest > 0 and np.count_nonzero(np.isfinite(values)) >= _FEWEST_DIFFERENCES:
            what = f"is {std:g} {unit}, and no value is larger than {largest:.3g} {unit}: all of it is noise"
            do = "check the units of both"
            findings.append(of_facts("suspicious", "stated noise", what, do, f"[sensor] {name}"))
    return findings


def check_seen_noise(experiment: Experiment) -> list[Finding]:
    """Rows in one step repeat one measurement, and scatter as stated.

    The scatter is taken from differences of neighbouring rows within a step without motion, so that a slow drift does
    not count. Below six differences it tells nothing.
    """
    findings = []
    still = _still(experiment)
    for channel, _, values in _channels(experiment):
        name, std, unit = _stated(experiment, channel)
        differences = np.diff(values, axis=0)[still]
        differences = differences[np.isfinite(differences)]
        if len(differences) < _FEWEST_DIFFERENCES or not std > 0:
            continue
        seen = float(np.sqrt(np.mean(differences**2) / 2))
        key = f"[sensor] {name}"
        if seen == 0:
            what = f"is {std:g} {unit}, and repeated rows show no noise at all"
            do = "export raw values; a simulated or filtered column has no noise to weigh it by"
            findings.append(of_facts("suspicious", "seen noise", what, do, key))
        elif seen > _TOO_MUCH * std or seen < _TOO_LITTLE * std:
            what = f"is {std:g} {unit}, and repeated rows scatter by {seen:.2g} {unit}"
            do = "state what repeated rows show; if they differ by a thousand, check the units"
            findings.append(of_facts("suspicious", "seen noise", what, do, key))
    return findings


def _still(experiment: Experiment) -> np.ndarray:
    """Tell between which neighbouring rows nothing was moved, (n − 1,)."""
    moved = np.linalg.norm(np.diff(experiment.position, axis=0), axis=1)
    least = 5 * max(experiment.sensor.position_std, 0.0) * np.sqrt(2) + 1e-9
    rest = at_rest(experiment)
    same = np.diff(experiment.step) == 0
    return np.asarray(same & ((moved < least) | (rest[1:] & rest[:-1])))


def _channels(experiment: Experiment) -> Iterator[tuple[str, tuple[str, ...], FloatArray]]:
    """Yield kind, columns and values of what was measured; a load that drives the gripper was not, but is known."""
    rows, beads = experiment.fiducials.shape[:2]
    if experiment.driven == "pose":
        yield "forces", WRENCH_COLUMNS[:3], experiment.wrench[:, :3]
        yield "torques", WRENCH_COLUMNS[3:], experiment.wrench[:, 3:]
    yield "beads", fiducial_columns(beads), experiment.fiducials.reshape(rows, -1)


def _stated(experiment: Experiment, channel: str) -> tuple[str, float, str]:
    sensor = experiment.sensor
    return {
        "forces": ("force_std", sensor.force_std, "N"),
        "torques": ("torque_std", sensor.torque_std, "N·m"),
        "beads": ("fiducial_std", sensor.fiducial_std, "m"),
    }[channel]
