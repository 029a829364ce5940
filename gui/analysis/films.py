"""A body through time as plain arrays, ready to be drawn: its surface, what colours it, its beads and their residuals.

Lengths are in millimetres, tissue frame.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.result import DeformedMesh, Place, Trace
from estimator.effects.blocks import Block
from estimator.experiment import Experiment
from estimator.fem.discretisation.mesh import Mesh, interpolation_rows
from estimator.fem.discretisation.surface import boundary_faces, facets, outlines
from estimator.fit.result import ExperimentFit
from estimator.report.drawing.rounding import round_figure, round_figure_above
from estimator.report.drawing.scene import MM, gripped_surface, held_pieces
from estimator.report.drawing.within import Shell, carried, shells_within

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Part = Literal["tissue", "anchor", "grasp"]

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
    place : centres (n, 3) of a local cause, which moves with the tissue, and its radius
    marked : (f,) bool, the pieces where a cause sits that has no such place
    within : cavities, and regions of another stiffness
    within_at : returns the corners (p, 3) of each of these at an instant
    """

    surface: Surface
    points_at: Callable[[int], FloatArray]
    values: FloatArray
    scale: Scale | None
    beads: FloatArray
    arrows: FloatArray
    magnified: float
    captions: tuple[str, ...]
    place: tuple[FloatArray, float] | None
    marked: NDArray[np.bool_]
    within: tuple[Shell, ...]
    within_at: Callable[[int], tuple[FloatArray, ...]]

    def __len__(self) -> int:
        return len(self.captions)


def film_of_fit(mesh: Mesh, fit: ExperimentFit) -> Film:
    """Return the deformed mesh of a fit, coloured by the residual of its beads."""
    beads = placed(fit.experiment.fiducials, fit.fiducials)
    missed = MM * (beads - fit.fiducials)
    body = DeformedMesh(mesh, fit.displacements, fit.state_of_row)
    return _film(body, replace(fit.experiment, fiducials=beads), missed, missed, None, None)


def film_of_trace(trace: Trace, predicted: FloatArray, place: Place | None, block: Block | None) -> Film:
    """Return the deformed mesh of a diagnosis, coloured by what a prediction (n, 6 + 3m) misses of the beads.

    Scale and arrows are those of the baseline whatever the prediction, so that they can be compared.

    Parameters
    ----------
    place : of a local cause; None for one that sits nowhere in particular
    block : of the rig where such a cause sits; None where it sits in none
    """
    seen = trace.experiment.fiducials
    at_first, now = (one[:, 6:].reshape(seen.shape) for one in (trace.before, predicted))
    before, after = (MM * (placed(seen, one) - one) for one in (at_first, now))
    experiment = replace(trace.experiment, fiducials=placed(seen, at_first))
    return _film(trace.body, experiment, after, before, place, None if place is not None else block)


def placed(seen: FloatArray, predicted: FloatArray) -> FloatArray:
    """Return beads (n, m, 3), m, with the coordinates that no row measures where they are predicted.

    So those that one camera sees get a height, of which nothing is missed.
    """
    measured = np.isfinite(seen)
    never = ~measured.any(axis=(0, 1))
    return np.where(never & measured.any(axis=2, keepdims=True), predicted, seen)


def _body_film(body: DeformedMesh, experiment: Experiment) -> tuple[Surface, Callable[[int], FloatArray]]:
    """Return the surface with the gripped tissue at rest, and what moves its points."""
    mesh = body.mesh
    faces = boundary_faces(mesh)
    extent = MM * np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)])
    free = _surface(mesh.points, facets(faces), outlines(faces)[:, :-1], experiment)
    at_rest, moved, state_of_row = free.points, MM * body.displacements, body.state_of_row

    def points_at(row: int) -> FloatArray:
        gripped = gripped_surface(experiment, extent, row).reshape(-1, 3)
        return np.concatenate([at_rest + moved[state_of_row[row]], gripped])

    return _with_grasp(free, gripped_surface(experiment, extent, 0)), points_at


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


def _surface(points_m: FloatArray, pieces: IntArray, rims: IntArray, experiment: Experiment) -> Surface:
    parts = np.full(len(pieces), "tissue")
    for anchor in experiment.anchors:
        parts[held_pieces(anchor, points_m, pieces)] = "anchor"
    parts[held_pieces(experiment.grasp.box, points_m, pieces)] = "grasp"
    return Surface(MM * points_m, pieces, rims, parts)


def _film(
    body: DeformedMesh,
    experiment: Experiment,
    missed: FloatArray,
    compared: FloatArray,
    place: Place | None,
    block: Block | None,
) -> Film:
    """Return a film of residuals ``missed`` (n, m, 3), mm; ``compared`` are those that set scale and arrows."""
    surface, points_at = _body_film(body, experiment)
    length_um, compared_um = (1e3 * np.linalg.norm(one, axis=2) for one in (missed, compared))
    known = compared_um[np.isfinite(compared_um)]
    top = float(np.percentile(known, _SCALE_PERCENTILE)) if len(known) else 0.0
    longest = 1e-3 * float(known.max(initial=0.0))
    size = float(np.ptp(surface.points, axis=0).max())
    magnified = max(1.0, round_figure(_LONGEST_ARROW * size / longest)) if longest > 0 else 1.0
    middles = surface.points[surface.pieces].mean(axis=1)
    shells = shells_within(experiment.phantom)
    in_mesh = carried(shells, body.mesh)

    def within_at(row: int) -> tuple[FloatArray, ...]:
        displacement = body.displacements[body.state_of_row[row]]
        return tuple(MM * one.points(displacement) for one in in_mesh)

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
        None if place is None else (_carried(body, place), MM * place.radius),
        _where_it_sits(surface, block),
        shells,
        within_at,
    )


def _carried(body: DeformedMesh, place: Place) -> FloatArray:
    """Return where the tissue carries the centre of a place, (n, 3)."""
    centre = np.array(place.centre)
    nodes, weights = interpolation_rows(body.mesh, centre[None], tolerance_m=np.inf)
    moved = np.einsum("k,skx->sx", weights[0], body.displacements[:, nodes[0]])
    return MM * (centre + moved[body.state_of_row])


def _where_it_sits(surface: Surface, block: Block | None) -> NDArray[np.bool_]:
    """Return which pieces (f,) of the surface are the block of the rig; none where it is no part of the surface."""
    match block.pictured if block is not None else "":
        case "anchor" | "grasp" as part:
            return np.asarray(surface.parts == part)
        case "underside":
            height = surface.points[surface.pieces][..., 2]
            return np.asarray((height <= surface.points[:, 2].min() + MM * _ON_THE_FACE_M).all(axis=1))
    return np.zeros(len(surface.pieces), dtype=np.bool_)


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
