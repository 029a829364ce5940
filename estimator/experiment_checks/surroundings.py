"""Gravity and density: what the Earth and matter are."""

import numpy as np

from estimator.experiment.model import Experiment
from estimator.experiment_checks.finding import Finding, Grade, of_facts
from estimator.experiment_checks.readings import SURELY, body_box, longest_edge

_SHARE_OF_FORCE = 0.1
_NEARLY_HALF = 0.015
_EARTH = (9.76, 9.84)  # m/s², from the equator's heights to the poles


def check_gravity(experiment: Experiment) -> list[Finding]:
    """Gravity is the Earth's, or left out as zero."""
    size = float(np.linalg.norm(experiment.environment.gravity))
    if size == 0 or _EARTH[0] <= size <= _EARTH[1]:
        return []
    grade: Grade = "wrong" if size > 20 else "suspicious"
    what = f"is {size:g} m/s2 in all, and the Earth's is 9.81"
    return [of_facts(grade, "gravity", what, "write m/s2 in the tissue frame", "[environment] gravity")]


def check_weight(experiment: Experiment) -> list[Finding]:
    """What nothing carries hangs by its grasp and anchors, and pulls at them from the first row on."""
    environment, sensor = experiment.environment, experiment.sensor
    edges = np.subtract(body_box(experiment).upper, body_box(experiment).lower)
    direction = np.asarray(environment.gravity)
    weight = float(np.prod(edges)) * experiment.phantom.density * float(np.linalg.norm(direction))
    forces = experiment.wrench[:, :3]
    if not weight or not np.isfinite(forces).any():
        return []
    largest = float(np.nanmax(np.abs(forces)))
    where = "[environment] weight"
    if environment.weight == "left_out":
        if environment.surface_below == "table" or weight < _SHARE_OF_FORCE * largest:
            return []
        what = f"is left out, nothing lies below, and the phantom weighs {weight:.3g} N of forces to {largest:.3g} N"
        do = 'if it hangs, write weight = "acts" in retraction-experiment/2'
        return [of_facts("suspicious", "weight", what, do, where)]
    first = forces[0] @ (direction / np.linalg.norm(direction))
    at_centre = float(np.linalg.norm(experiment.position[0] - experiment.grasp.centre))
    still = at_centre <= SURELY * sensor.position_std + 1e-3 * longest_edge(experiment)
    absolute = sensor.force_zero == "no_load" or experiment.driven == "load"
    quiet = abs(first) < SURELY * sensor.force_std < _SHARE_OF_FORCE * weight
    lifted = -forces @ (direction / np.linalg.norm(direction))
    least = float(np.min(lifted[lifted > 0], initial=np.inf))
    if experiment.driven == "load" and abs(least / weight - 0.5) < _NEARLY_HALF:
        what = (
            f"acts, and the smallest load, {least:.3g} N, is a half of {weight:.3g} N, as if it stood for it"
        )
        do = "state the load that hung besides: else a part of the weight counts twice"
        return [of_facts("suspicious", "weight", what, do, where)]
    if environment.weight == "acts" and absolute and still and quiet:
        what = f"acts in the first row, where the gripper is at rest and feels nothing of {weight:.3g} N"
        do = 'if that row is of the phantom before it hung, write weight = "acts_after_first_row"'
        return [of_facts("suspicious", "weight", what, do, where)]
    return []


def check_density(experiment: Experiment) -> list[Finding]:
    """Tissue and elastomers are about as dense as water."""
    density = experiment.phantom.density
    if 500 <= density <= 3000:
        return []
    grade: Grade = "wrong" if not 100 <= density <= 20_000 else "suspicious"
    what = f"is {density:g} kg/m3, and water's is 1000"
    return [of_facts(grade, "density", what, "write kg/m3", "[phantom] density")]
