"""Blocks with a rough top: the relief is a ridged multifractal.

F. K. Musgrave, "Procedural fractal terrains", in D. S. Ebert et al., "Texturing and Modeling: A Procedural Approach",
3rd ed. (2003), ch. 16, over the gradient noise of K. Perlin, "Improving noise", SIGGRAPH 2002.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.geometry.shapes import block_surface
from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

_OCTAVES = 5
_LACUNARITY = 2.0
_SPECTRAL_EXPONENT = 1.0
_OFFSET = 1.0
_GAIN = 2.0
# Coarsest waves along the block's longer side.
_WAVES = 4.0
_GRADIENTS = 256


def rough_block(
    size_m: tuple[float, float, float], roughness: float, seed: int, cells: tuple[int, int, int] = (60, 60, 6)
) -> Surface:
    """Return a block around the origin whose top carries a relief.

    The bottom stays flat, and the sides stay upright. The relief has mean zero over the top's grid.

    Parameters
    ----------
    size_m : edges of the smooth block
    roughness : height from the relief's lowest to its highest point, as a share of ``size_m[2]``
    seed : of the relief
    cells : squares on the faces along x, y and z
    """
    block, relief, top = _block_and_relief(size_m, seed, cells)
    relief -= relief[top].mean()
    return _with_relief(block, relief * (roughness * size_m[2] / np.ptp(relief[top])), size_m[2])


def raised_block(
    size_m: tuple[float, float, float], height_m: float, seed: int, cells: tuple[int, int, int] = (60, 60, 6)
) -> Surface:
    """Return a block around the origin on whose top a relief stands, so that it is thicker than the smooth one.

    Parameters
    ----------
    size_m, seed, cells : as for :func:`rough_block`
    height_m : of the relief's highest point above the block; its lowest lies on it
    """
    block, relief, top = _block_and_relief(size_m, seed, cells)
    relief -= relief[top].min()
    return _with_relief(block, relief * (height_m / np.ptp(relief[top])), size_m[2])


def _block_and_relief(
    size_m: tuple[float, float, float], seed: int, cells: tuple[int, int, int]
) -> tuple[Surface, FloatArray, NDArray[np.bool_]]:
    """Return the smooth block, the relief above each of its vertices, and which of them are on top."""
    block = block_surface(size_m, cells)
    top = np.isclose(block.vertices[:, 2], size_m[2] / 2)
    return block, ridged_multifractal(_WAVES * block.vertices[:, :2] / max(size_m[:2]), seed), top


def _with_relief(block: Surface, relief_m: FloatArray, thickness_m: float) -> Surface:
    """Raise the vertices by the relief (n,), m: those on top by all of it, those below in proportion."""
    points = block.vertices.copy()
    points[:, 2] += (points[:, 2] / thickness_m + 0.5) * relief_m
    return closed_surface(points, block.triangles, "rough block")


def ridged_multifractal(points: FloatArray, seed: int) -> FloatArray:
    """Return the heights (n,) of Musgrave's ridged multifractal at points (n, 2) in wavelengths of the first octave."""
    random = np.random.default_rng(seed)
    directions = random.uniform(0.0, 2 * np.pi, _GRADIENTS)
    gradients = np.stack([np.cos(directions), np.sin(directions)], axis=1)
    shuffled = random.permutation(_GRADIENTS)
    height, weight, frequency = np.zeros(len(points)), np.ones(len(points)), 1.0
    for _ in range(_OCTAVES):
        ridge = (_OFFSET - np.abs(_gradient_noise(frequency * points, gradients, shuffled))) ** 2 * weight
        height += ridge * frequency**-_SPECTRAL_EXPONENT
        weight = np.clip(_GAIN * ridge, 0.0, 1.0)
        frequency *= _LACUNARITY
    return height


def _gradient_noise(points: FloatArray, gradients: FloatArray, shuffled: NDArray[np.int64]) -> FloatArray:
    """Return Perlin's noise (n,), within ±1, at points (n, 2): zero on the lattice of whole numbers."""
    cell = np.floor(points).astype(np.int64)
    x, y = (points - cell).T

    def ramp(i: int, j: int) -> FloatArray:
        corner = shuffled[(cell[:, 0] + i + shuffled[(cell[:, 1] + j) % _GRADIENTS]) % _GRADIENTS]
        return gradients[corner, 0] * (x - i) + gradients[corner, 1] * (y - j)

    u, v = (t**3 * (t * (6 * t - 15) + 10) for t in (x, y))
    low = ramp(0, 0) + u * (ramp(1, 0) - ramp(0, 0))
    high = ramp(0, 1) + u * (ramp(1, 1) - ramp(0, 1))
    return np.sqrt(2.0) * (low + v * (high - low))
