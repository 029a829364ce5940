"""Places in the plane of the phantom, for what sits somewhere in the tissue or below it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Constant, Values
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]

_EDGE_M = 0.1
_PLACES_M = (-0.04, -0.02, 0.0, 0.02, 0.04)

CENTRE = tuple(Constant(name, "m", _PLACES_M, lower=-0.1, upper=0.1) for name in ("centre_x", "centre_y"))


# Half the width over which a region ends, unless the mesh is coarser.
_RIM_M = 1e-3


def belonging(depth_m: FloatArray, spacing_m: FloatArray) -> FloatArray:
    """Return how far points belong to a region, from 0 to 1, by how deep they lie in it and how far apart, m."""
    return np.asarray(0.5 * (1 + np.tanh(depth_m / np.maximum(_RIM_M, spacing_m / 2))))


def places_of(experiment: Experiment, starts: Sequence[Values]) -> list[dict[str, float]]:
    """Return starts of a search, spread over the phantom's edges, without the places inside the grasp.

    Their constants ``centre_x`` and ``centre_y`` are those of a phantom with edges of 100 mm.
    """
    stretch = np.array(experiment.phantom.size_m) / _EDGE_M
    spread = [
        {**start, "centre_x": stretch[0] * start["centre_x"], "centre_y": stretch[1] * start["centre_y"]}
        for start in starts
    ]
    lower, upper = experiment.grasp.box.lower, experiment.grasp.box.upper
    return [
        start
        for start in spread
        if not all(lower[i] <= start[name] <= upper[i] for i, name in enumerate(("centre_x", "centre_y")))
    ]
