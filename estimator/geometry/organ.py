"""A surface in the manner of a liver: a thick right and a thin left lobe, domed above, flat and hollow below.

A sphere is stretched, tapered, dented and bent by maps that are one-to-one in space, so that the surface cannot cross
itself, whatever the seed.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.geometry.shapes import sphere_surface
from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

_PROPORTIONS = (1.0, 0.62, 0.33)
_WAVES = 12
_WAVE_HEIGHT = 0.06


def organ_surface(seed: int, length_m: float = 0.2, subdivisions: int = 4) -> Surface:
    """Return a liver-like surface, its bounding box centred at the origin.

    The thick lobe lies at −x, the thin one at +x; the flat side looks to −z.

    Parameters
    ----------
    seed : of the gentle bumps
    length_m : of the bounding box along x
    subdivisions : of the icosahedron; 4 gives 5120 triangles
    """
    sphere = sphere_surface(1.0, subdivisions)
    x, y, z = _bumpy(sphere.vertices, np.random.default_rng(seed)).T
    leftward = (1 + x) / 2
    y = y * (1 - 0.35 * leftward) + 0.25 * x**2
    z = z * (1 + 0.3 * z) * (1 - 0.55 * leftward)
    z = z - 0.45 * x**2 - 0.12 * np.exp(-(((x - 0.3) / 0.12) ** 2))
    points = np.stack([x, y, z], axis=1) * _PROPORTIONS
    points *= length_m / np.ptp(points[:, 0])
    points -= (points.min(axis=0) + points.max(axis=0)) / 2
    return closed_surface(points, sphere.triangles, "organ")


def _bumpy(directions: FloatArray, random: np.random.Generator) -> FloatArray:
    """Scale directions (n, 3) by 1 plus long waves of random direction and phase."""
    vectors = random.normal(0.0, 1.8, (_WAVES, 3))
    phases = random.uniform(0.0, 2 * np.pi, _WAVES)
    waves = np.cos(directions @ vectors.T + phases).sum(axis=1)
    return directions * (1 + _WAVE_HEIGHT / np.sqrt(_WAVES / 2) * waves)[:, None]
