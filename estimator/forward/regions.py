"""The regions of a phantom whose tissue has another modulus, on its mesh."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment import TissueRegion
from estimator.fem.assembly.body import with_modulus
from estimator.fem.assembly.regions import StifferRegion
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.quadrature import points_of_parts
from estimator.geometry.grading import Ball
from estimator.surfaces.queries import inside, nearest
from estimator.surfaces.reading import read_surface
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

# Points of a region's grid along its longest edge, and rows of them around it.
_ALONG, _AROUND = 32, 2
# Of the cube root of a region's volume, the edges in it on a default mesh.
_EDGE = 0.4


def with_regions(problem: RetractionProblem, regions: Sequence[TissueRegion]) -> RetractionProblem:
    """Return the problem with each region as stiff as it says.

    An integration point counts by how much of the part that it stands for lies in a region. Where regions share tissue,
    their ratios multiply.

    Raises
    ------
    InputError
        The file of a region cannot be read, or it holds no tissue.
    """
    if not regions:
        return problem
    points = points_of_parts(problem.body.mesh)
    log_factor = np.zeros(problem.body.volume.shape)
    found = []
    for region in regions:
        surface = read_surface(region.surface, region.unit).surface
        share = inside(surface, points.reshape(-1, 3)).reshape(points.shape[:-1]).mean(axis=2)
        if not share.any():
            raise InputError(
                f"{region.surface}: region {region.name} holds no tissue; is it in the same frame?"
            )
        log_ratio = float(np.log(region.modulus_ratio))
        log_factor += log_ratio * share
        found.append(_on_grid(surface, log_ratio))
    return replace(problem, body=with_modulus(problem.body, np.exp(log_factor)), regions=tuple(found))


def ball_around(region: TissueRegion, coarser: float) -> Ball:
    """Return a ball as wide as a region, with the edges wanted in it on a mesh so many times coarser than the default.

    Raises
    ------
    InputError
        Its file cannot be read.
    """
    surface = read_surface(region.surface, region.unit).surface
    x, y, z = surface.bounds.mean(axis=0).tolist()
    radius = float(np.ptp(surface.bounds, axis=0).max()) / 2
    return Ball((x, y, z), radius, _EDGE * coarser * surface.volume_m3 ** (1 / 3))


def _on_grid(surface: Surface, log_ratio: float) -> StifferRegion:
    lower, upper = surface.bounds
    spacing = float((upper - lower).max()) / (_ALONG - 1)
    origin = lower - _AROUND * spacing
    counts = np.ceil((upper - lower) / spacing).astype(int) + 1 + 2 * _AROUND
    grid = np.moveaxis(np.indices(counts), 0, -1).reshape(-1, 3) * spacing + origin
    _, foot = nearest(surface.corners, grid)
    away = np.linalg.norm(grid - foot, axis=1)
    depth = np.where(inside(surface, grid), away, -away).reshape(counts)
    return StifferRegion(log_ratio, depth, origin, spacing)
