"""The phantom and where it is held, from what a mapping states."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from estimator.experiment.holds import Box, Vector
from estimator.experiment.model import Phantom
from estimator.importing.mapping import BoxText, ImportMapping
from estimator.surfaces.reading import surface_bounds
from estimator.surfaces.surface import Surface
from estimator.surfaces.writing import write_stl

_SIDES = 48
_BEYOND = 1e-3  # of the longest edge, by which a box reaches out of the body
_INTO = (
    5e-3  # of the edge across a face, by which a box that holds the face reaches into the body at the most
)


@dataclass(frozen=True, slots=True)
class Body:
    """The phantom, and the box that it fills."""

    phantom: Phantom
    bounds: Box


def body_of(mapping: ImportMapping, scratch: Path) -> Body:
    """Return the phantom; the surface of a cylinder is written into the folder ``scratch``.

    Raises
    ------
    InputError
        A surface cannot be read.
    """
    if mapping.shape == "surface":
        assert mapping.surface is not None
        lower, upper = surface_bounds(mapping.surface).tolist()
        size = mapping.size or _vector(np.subtract(upper, lower))
        phantom = Phantom("surface", size, mapping.surface, mapping.density)
        return Body(phantom, Box(_vector(lower), _vector(upper)))
    assert mapping.size is not None
    half = np.array(mapping.size) / 2
    bounds = Box(_vector(-half), _vector(half))
    if mapping.shape == "cylinder":
        file = scratch / "phantom.stl"
        write_stl(cylinder_surface(mapping.size[0], mapping.size[2]), file)
        return Body(Phantom("surface", mapping.size, file, mapping.density, "m"), bounds)
    phantom = Phantom("block", mapping.size, None, mapping.density, stays_flat=mapping.stays_flat)
    return Body(phantom, bounds)


def cylinder_surface(diameter: float, height: float, sides: int = _SIDES) -> Surface:
    """Return a cylinder around the z axis, m: a prism of so many sides with the cylinder's volume."""
    # the polygon of n corners on a circle of radius r has the area n/2 r² sin(2π/n)
    radius = diameter / 2 * np.sqrt(2 * np.pi / (sides * np.sin(2 * np.pi / sides)))
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    low, high = (np.column_stack([ring, np.full(sides, z)]) for z in (-height / 2, height / 2))
    vertices = np.concatenate([low, high, [[0, 0, -height / 2], [0, 0, height / 2]]])
    here, after = np.arange(sides), np.roll(np.arange(sides), -1)
    bottom, top = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    triangles = np.concatenate(
        [
            np.stack([here, after, after + sides], axis=1),
            np.stack([here, after + sides, here + sides], axis=1),
            np.stack([bottom, after, here], axis=1),
            np.stack([top, here + sides, after + sides], axis=1),
        ]
    )
    return Surface(vertices, triangles.astype(np.int64))


def box_of(text: BoxText, bounds: Box) -> Box:
    """Return a box from its corners, or from a face of the body: it reaches a little beyond, so that none is missed."""
    if text.corners is not None:
        return Box(*text.corners)
    assert text.face is not None
    lower, upper = np.array(bounds.lower), np.array(bounds.upper)
    beyond = _BEYOND * float((upper - lower).max())
    axis = text.face.axis
    low, high = lower - beyond, upper + beyond
    depth = text.face.depth or min(beyond, _INTO * float(upper[axis] - lower[axis]))
    if text.face.upper:
        low[axis] = upper[axis] - depth
    else:
        high[axis] = lower[axis] + depth
    return Box(_vector(low), _vector(high))


def centre_of(text: BoxText, box: Box, bounds: Box) -> Vector:
    """Return where a gripper's origin is by default: the middle of what its box holds, or of its face."""
    shared = box.intersection(bounds) or box
    middle = (np.array(shared.lower) + shared.upper) / 2
    if text.face is not None:
        edge = bounds.upper if text.face.upper else bounds.lower
        middle[text.face.axis] = edge[text.face.axis] - text.face.depth * (1 if text.face.upper else -1)
    return _vector(middle)


def _vector(values: object) -> Vector:
    x, y, z = np.asarray(values, dtype=np.float64).tolist()
    return x, y, z
