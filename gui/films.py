"""A body through time as plain arrays, ready to be drawn: its surface, what colours it, its beads and their residuals.

Lengths are in millimetres, tissue frame.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.result import Place, Trace
from estimator.experiment import Box, Experiment
from estimator.experiment.stl import read_stl
from estimator.fem.mesh import Mesh
from estimator.fem.surface import boundary_faces, facets, outlines
from estimator.fit.result import ExperimentFit
from estimator.report.rounding import round_figure, round_figure_above
from estimator.report.scene import MM, box_surface, gripped_surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Part = Literal["tissue", "anchor", "grasp"]

# The longest edge of a block is cut into so many pieces, the others into pieces of about that size.
_PIECES = 20
# The longest arrow is drawn about as long as this share of the body.
_LONGEST_ARROW = 0.08
# The scale ends where this share of all residuals lies below.
_SCALE_PERCENTILE = 98.0
_ON_THE_FACE_M = 1e-4


@dataclass(frozen=True, eq=False)
class Surface:
    """The surface of a body at rest.

    Attributes
    ----------
    points : (p, 3)
    pieces : (f, k) corners of its flat pieces, anticlockwise seen from outside
    rims : (r, j) points along the rim of each element face, in order
    parts : f of ``"tissue"``, ``"anchor"`` and ``"grasp"``
    """

    points: FloatArray
    pieces: IntArray
    rims: IntArray
    parts: NDArray[np.str_]


@dataclass(frozen=True, slots=True)
class Scale:
    """What colours mean: from 0 to ``top``, in ``unit``."""

    title: str
    unit: str
    top: float


@dataclass(frozen=True, eq=False)
class Film:
    """A body at n instants.

    Attributes
    ----------
    surface : at rest
    points_at : returns the points (p, 3) of the surface at an instant
    values : (n, f) of each piece on the scale; NaN where nothing is known of it
    scale : of the values, None where nothing is to be coloured
    beads : (n, m, 3), NaN where one was not seen
    arrows : (n, m, 3) from the beads, ``magnified`` times too long
    captions : n lines that tell the instant
    place : centre (3,) and radius of a local cause
    """

    surface: Surface
    points_at: Callable[[int], FloatArray]
    values: FloatArray
    scale: Scale | None
    beads: FloatArray
    arrows: FloatArray
    magnified: float
    captions: tuple[str, ...]
    place: tuple[FloatArray, float] | None = None

    def __len__(self) -> int:
        return len(self.captions)


def film_of_fit(mesh: Mesh, fit: ExperimentFit) -> Film:
    """Return the deformed mesh of a fit, coloured by the residual of its beads."""
    faces = boundary_faces(mesh)
    experiment = fit.experiment
    extent = MM * np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)])
    body = _surface(mesh.points, facets(faces), outlines(faces)[:, :-1], experiment)
    surface = _with_grasp(body, gripped_surface(experiment, extent, 0))
    at_rest, moved, state_of_row = body.points, MM * fit.displacements, fit.state_of_row

    def points_at(row: int) -> FloatArray:
        gripped = gripped_surface(experiment, extent, row).reshape(-1, 3)
        return np.concatenate([at_rest + moved[state_of_row[row]], gripped])

    return _film(surface, points_at, experiment, fit.fiducials, place=None)


def _with_grasp(body: Surface, gripped: FloatArray) -> Surface:
    """Add the outer faces (g, 4, 3) of the gripped tissue, which is no part of the mesh."""
    corners = len(body.points) + np.arange(gripped.shape[0] * 4).reshape(-1, 4)
    triangles = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    pieces = corners if body.pieces.shape[1] == 4 else triangles
    # a rim of fewer corners than the others' has its last one several times
    rims = corners[:, np.minimum(np.arange(body.rims.shape[1]), 3)]
    return Surface(
        np.concatenate([body.points, gripped.reshape(-1, 3)]),
        np.concatenate([body.pieces, pieces]),
        np.concatenate([body.rims, rims]),
        np.concatenate([body.parts, np.full(len(pieces), "grasp")]),
    )


def film_of_trace(trace: Trace, predicted: FloatArray, place: Place | None) -> Film:
    """Return the body at rest with its beads as they were seen, coloured by what a prediction (n, 6 + 3m) misses."""
    surface = resting_surface(trace.experiment)
    fiducials = predicted[:, 6:].reshape(trace.experiment.fiducials.shape)
    return _film(surface, lambda row: surface.points, trace.experiment, fiducials, place)


def resting_surface(experiment: Experiment) -> Surface:
    """Return the surface of the phantom as it is stated: a block, or the triangles of its file."""
    phantom = experiment.phantom
    if phantom.surface is None:
        half = np.array(phantom.size_m) / 2
        x, y, z = np.ceil(_PIECES * half / half.max()).astype(int).tolist()
        corners = box_surface(np.stack([-half, half]), (x, y, z))
    else:
        corners = read_stl(phantom.surface)
    points, numbers = np.unique(corners.reshape(-1, 3).round(7), axis=0, return_inverse=True)
    pieces = numbers.reshape(corners.shape[:2]).astype(np.int64)
    return _surface(points, pieces, pieces, experiment)


def _surface(points_m: FloatArray, pieces: IntArray, rims: IntArray, experiment: Experiment) -> Surface:
    parts = np.full(len(pieces), "tissue")
    held = np.any([_near(anchor).contains(points_m) for anchor in experiment.anchors], axis=0)
    if np.ndim(held):
        parts[held[pieces].all(axis=1)] = "anchor"
    parts[_near(experiment.grasp.box).contains(points_m)[pieces].all(axis=1)] = "grasp"
    return Surface(MM * points_m, pieces, rims, parts)


def _near(box: Box) -> Box:
    lower = np.array(box.lower) - _ON_THE_FACE_M
    upper = np.array(box.upper) + _ON_THE_FACE_M
    return Box((lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2]))


def _film(
    surface: Surface,
    points_at: Callable[[int], FloatArray],
    experiment: Experiment,
    predicted_m: FloatArray,
    place: Place | None,
) -> Film:
    missed = MM * (experiment.fiducials - predicted_m)
    length_um = 1e3 * np.linalg.norm(missed, axis=2)
    known = length_um[np.isfinite(length_um)]
    top = float(np.percentile(known, _SCALE_PERCENTILE)) if len(known) else 0.0
    longest = 1e-3 * float(known.max(initial=0.0))
    size = float(np.ptp(surface.points, axis=0).max())
    magnified = max(1.0, round_figure(_LONGEST_ARROW * size / longest)) if longest > 0 else 1.0
    middles = surface.points[surface.pieces].mean(axis=1)
    return Film(
        surface,
        points_at,
        spread(length_um, MM * experiment.fiducials_rest, middles),
        Scale("bead residual", "µm", round_figure_above(top)) if top > 0 else None,
        MM * experiment.fiducials,
        magnified * missed,
        magnified,
        tuple(
            f"step {step}, {phase.replace('_', ' ')}, {time:.1f} s"
            for step, phase, time in zip(experiment.step, experiment.phase, experiment.time, strict=True)
        ),
        None if place is None else (MM * np.array(place.centre), MM * place.radius),
    )


def spread(values: FloatArray, beads: FloatArray, places: FloatArray) -> FloatArray:
    """Interpolate values (n, m) of beads at rest (m, 3) to places (f, 3), by the inverse square of the distance.

    Farther from every bead than these are from one another nothing is known: NaN. So it is where no bead was seen.
    """
    if len(beads) == 0:
        return np.full((len(values), len(places)), np.nan)
    squared = np.sum((places[:, None] - beads[None]) ** 2, axis=2)
    apart = np.sum((beads[:, None] - beads[None]) ** 2, axis=2)
    spacing = np.sqrt(np.median(np.sort(apart, axis=1)[:, min(1, len(beads) - 1)])) or np.inf
    weight = 1.0 / (squared + (0.2 * spacing if np.isfinite(spacing) else 1.0) ** 2)
    seen = np.isfinite(values)
    total = seen.astype(np.float64) @ weight.T
    found = np.divide(
        np.where(seen, values, 0.0) @ weight.T, total, where=total > 0, out=np.full(total.shape, np.nan)
    )
    found[:, np.sqrt(squared.min(axis=1)) > spacing] = np.nan
    return found
