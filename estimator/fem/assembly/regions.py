"""Regions of the tissue that are stiffer or softer than the rest, as they stand in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from estimator.fem.assembly.body import Body, with_modulus
from estimator.fem.discretisation.quadrature import quadrature_points

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StifferRegion:
    """A region by the depth of places in it, on a regular grid.

    Attributes
    ----------
    log_ratio : natural logarithm of its modulus over that of the rest
    depth : (i, j, k) float64, how deep each grid point lies in it, negative outside, m
    origin : (3,) float64, of the grid, tissue frame, m
    spacing : of the grid, m
    """

    log_ratio: float
    depth: FloatArray
    origin: FloatArray
    spacing: float

    def share(self, points: FloatArray, width: FloatArray) -> FloatArray:
        """Return how much of a part of the tissue lies in the region, from 0 to 1.

        It is continuous in the place, which a count of samples is not.

        Parameters
        ----------
        points : (e, q, 3) middles of the parts, m
        width : (e, q) of the parts, m
        """
        index = (points - self.origin) / self.spacing
        within = np.clip(index, 0.0, np.array(self.depth.shape) - 1.0)
        beyond = self.spacing * np.linalg.norm(index - within, axis=-1)
        depth = map_coordinates(self.depth, np.moveaxis(within, -1, 0), order=1) - beyond
        return np.clip(0.5 + depth / width, 0.0, 1.0)


def with_regions_in_place(moved: Body, before: Body, regions: Sequence[StifferRegion]) -> Body:
    """Return a body whose nodes were moved through the tissue, with its regions where they were.

    Parameters
    ----------
    moved : with the stiffness of ``before`` carried along by the elements
    before : with the regions in place
    """
    if not regions:
        return moved
    change = np.zeros_like(moved.volume)
    for region in regions:
        here, there = (
            region.share(quadrature_points(one.mesh), np.cbrt(one.rest_volume)) for one in (moved, before)
        )
        change += region.log_ratio * (here - there)
    # stiffer than all regions together, or softer, nothing becomes
    ratios = np.array([region.log_ratio for region in regions])
    log_modulus = np.log(moved.modulus)
    lowest = np.minimum(log_modulus, np.minimum(ratios, 0.0).sum())
    highest = np.maximum(log_modulus, np.maximum(ratios, 0.0).sum())
    return with_modulus(moved, np.exp(np.clip(log_modulus + change, lowest, highest) - log_modulus))
