"""Several experiments of one phantom: none stands there twice, and all are of one body."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from estimator.experiment.model import EXPERIMENT_FILE, OBSERVATIONS_FILE, Experiment
from estimator.experiment_checks.finding import Finding, Grade


def check_case(experiments: Sequence[Experiment]) -> list[Finding]:
    """Return what is wrong between the experiments of one case; their files are named with their folders."""
    findings = []
    for one, other in combinations(experiments, 2):
        if _same_measurements(one, other):
            what = f"holds the measurements of {_folder(one)}: one experiment would count twice"
            do = "remove one of the two folders"
            findings.append(_about(other, "wrong", "repeated experiments", what, do, OBSERVATIONS_FILE))
        elif one.order == other.order and one.phantom_id == other.phantom_id:
            what = f"order = {other.order}, as {_folder(one)}"
            do = "number the experiments of one mounting in the order in which they were made"
            findings.append(_about(other, "suspicious", "order of experiments", what, do, EXPERIMENT_FILE))
        if one.phantom_id != other.phantom_id:
            what = f'phantom_id = "{other.phantom_id}", and {_folder(one)} has "{one.phantom_id}"'
            do = "sort the experiments into folders of one phantom each, or correct phantom_id"
            findings.append(_about(other, "wrong", "one phantom", what, do, EXPERIMENT_FILE))
        elif not np.allclose(one.phantom.size_m, other.phantom.size_m, rtol=1e-3):
            what = f"[phantom] size differs from that of {_folder(one)}, which has the same phantom_id"
            do = "give one phantom one size"
            findings.append(_about(other, "suspicious", "one phantom", what, do, EXPERIMENT_FILE))
    return findings


def _same_measurements(one: Experiment, other: Experiment) -> bool:
    return all(
        np.array_equal(a, b, equal_nan=True)
        for a, b in (
            (one.position, other.position),
            (one.wrench, other.wrench),
            (one.fiducials, other.fiducials),
        )
    )


def _folder(experiment: Experiment) -> str:
    return experiment.path.name if experiment.path is not None else experiment.name


def _about(experiment: Experiment, grade: Grade, check: str, what: str, do: str, file: str) -> Finding:
    return Finding(grade, check, what, do, f"{_folder(experiment)}/{file}")
