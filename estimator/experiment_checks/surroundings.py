"""Gravity and density: what the Earth and matter are."""

import numpy as np

from estimator.experiment.model import Experiment
from estimator.experiment_checks.finding import Finding, Grade, of_facts

_EARTH = (9.76, 9.84)  # m/s², from the equator's heights to the poles


def check_gravity(experiment: Experiment) -> list[Finding]:
    """Gravity is the Earth's, or left out as zero."""
    size = float(np.linalg.norm(experiment.environment.gravity))
    if size == 0 or _EARTH[0] <= size <= _EARTH[1]:
        return []
    grade: Grade = "wrong" if size > 20 else "suspicious"
    what = f"is {size:g} m/s2 in all, and the Earth's is 9.81"
    return [of_facts(grade, "gravity", what, "write m/s2 in the tissue frame", "[environment] gravity")]


def check_density(experiment: Experiment) -> list[Finding]:
    """Tissue and elastomers are about as dense as water."""
    density = experiment.phantom.density
    if 500 <= density <= 3000:
        return []
    grade: Grade = "wrong" if not 100 <= density <= 20_000 else "suspicious"
    what = f"is {density:g} kg/m3, and water's is 1000"
    return [of_facts(grade, "density", what, "write kg/m3", "[phantom] density")]
