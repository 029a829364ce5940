"""The deformed body at the farthest state, with what holds it, what pulls it and what was seen of it."""

from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.surface import boundary_faces, facets, outlines
from estimator.fit.result import ExperimentFit
from estimator.report.drawing.painter import Face, paint
from estimator.report.drawing.rounding import round_figure
from estimator.report.drawing.scene import MM, box_edges, farthest_row, gripped_surface, held_pieces
from estimator.report.drawing.stretch import largest_stretch
from estimator.report.drawing.view import View
from estimator.report.drawing.within import Kind, carried, contour, facing, shells_within
from estimator.report.theme import ANCHOR, GRASP, INK, MEASURED, MUTED, PREDICTED

FloatArray = NDArray[np.float64]

_VIEW = View(azimuth_deg=-115.0, elevation_deg=38.0)
_COLOUR_MAP = "YlGnBu"
# Stretch is singular along the rim of the grasp; the scale ends where this share of the surface lies below.
_SCALE_PERCENTILE = 99.0
_SMALLEST_SCALE = 0.01
_ELEMENT_RIM = (0.0, 0.0, 0.0, 0.3)
# Of what lies within the body and shines through it: colour and opacity, and the line around it.
_FILLED: dict[Kind, tuple[str, float]] = {"cavity": ("white", 0.55), "region": (INK, 0.3)}
_LINE: dict[Kind, Literal["--", "-"]] = {"cavity": "--", "region": "-"}
# The arrows of the axes are about this share of the body long.
_TRIAD_SHARE = 0.2


def draw_body(sheet: Figure, mesh: Mesh, fit: ExperimentFit) -> None:
    """Draw the surface, coloured by the largest principal stretch, with grasp, anchors and fiducials.

    Cavities and regions of another stiffness shine through it.
    """
    axes = sheet.add_axes((0.01, 0.01, 0.88, 0.9))
    rest = MM * np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)])
    row = farthest_row(fit.experiment)
    scale, faces = _surface(mesh, fit)
    faces += [_gripped_face(corners) for corners in gripped_surface(fit.experiment, rest, row)]
    paint(axes, _VIEW, faces)
    within = _shining_through(axes, mesh, fit)
    axes.add_collection(
        LineCollection(list(_VIEW.project(box_edges(rest))), colors=MUTED, linewidths=0.9, linestyles="--")
    )
    _fiducials(axes, MM * fit.experiment.fiducials[row], MM * fit.fiducials[row])
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()
    _triad(axes, round_figure(_TRIAD_SHARE * float(np.ptp(rest, axis=0).max())))
    bar = sheet.colorbar(scale, cax=sheet.add_axes((0.92, 0.2, 0.014, 0.55)), extend="max")
    bar.set_label("largest principal stretch")
    handles = [
        *axes.get_legend_handles_labels()[0],
        Patch(color=GRASP, label="gripped"),
        Patch(color=ANCHOR, label="anchored"),
        Line2D([], [], color=MUTED, linestyle="--", linewidth=0.9, label="outline at rest"),
        *within,
    ]
    sheet.legend(
        handles=handles, loc="upper right", ncols=-(-len(handles) // (1 + bool(within))), borderaxespad=0.2
    )


def _surface(mesh: Mesh, fit: ExperimentFit) -> tuple[ScalarMappable, list[Face]]:
    """Return the scale of colours and the element faces, split between nodes; those that stand still are anchored."""
    faces = boundary_faces(mesh)
    points = MM * (mesh.points + fit.displacement)
    pieces = facets(faces)
    values = largest_stretch(mesh, fit.displacement)[pieces].mean(axis=1)
    top = max(float(np.percentile(values, _SCALE_PERCENTILE)), 1 + _SMALLEST_SCALE)
    scale = ScalarMappable(Normalize(1.0, top), _COLOUR_MAP)
    colours = scale.to_rgba(values)
    colours[(fit.displacement == 0)[pieces].all(axis=(1, 2))] = to_rgba(ANCHOR)
    colours[held_pieces(fit.experiment.grasp.box, mesh.points, pieces)] = to_rgba(GRASP)
    parts = zip(
        points[outlines(faces)[:, :-1]],
        points[pieces].reshape(len(faces), -1, pieces.shape[1], 3),
        colours.reshape(len(faces), -1, 4),
        strict=True,
    )
    return scale, [Face(rim, split, of_split, _ELEMENT_RIM) for rim, split, of_split in parts]


def _gripped_face(corners: FloatArray) -> Face:
    colour = to_rgba(GRASP)
    return Face(corners, corners[None], np.array([colour]), colour)


def _shining_through(axes: Axes, mesh: Mesh, fit: ExperimentFit) -> list[Patch]:
    """Draw what lies within the body; return what tells of it."""
    found = {}
    for one in carried(shells_within(fit.experiment.phantom), mesh):
        shell, points = one.shell, MM * one.points(fit.displacement)
        triangles = shell.surface.triangles
        seen, flat = facing(points, triangles, _VIEW), _VIEW.project(points)
        fill, line = to_rgba(*_FILLED[shell.kind]), _LINE[shell.kind]
        axes.add_collection(
            PolyCollection(
                list(flat[triangles[seen]]), facecolors=[fill], edgecolors="none", antialiased=False, zorder=3
            )
        )
        outline = list(flat[contour(triangles, seen)])
        axes.add_collection(LineCollection(outline, colors=INK, linewidths=1.3, linestyles=line, zorder=3))
        found[shell.label] = Patch(facecolor=fill, edgecolor=INK, linestyle=line, label=shell.label)
    return list(found.values())


def _fiducials(axes: Axes, measured: FloatArray, predicted: FloatArray) -> None:
    for places, marker, size, colour, label in (
        (measured, "o", 8, MEASURED, "fiducial measured"),
        (predicted, "x", 5.5, PREDICTED, "fiducial predicted"),
    ):
        axes.plot(
            *_VIEW.project(places).T,
            linestyle="none",
            marker=marker,
            markersize=size,
            markerfacecolor="none",
            markeredgewidth=1.7,
            color=colour,
            label=label,
            path_effects=[withStroke(linewidth=3.4, foreground="white")],
            zorder=5,
        )


def _triad(axes: Axes, length: float) -> None:
    """Draw the axes of the tissue frame, each of a length in mm, in the lower left corner."""
    x, y = axes.get_xlim()[0] - 0.2 * length, axes.get_ylim()[0] + 0.4 * length
    style: dict[str, Any] = {"annotation_clip": False, "color": MUTED, "ha": "center", "va": "center"}
    arrow = {"arrowstyle": "-|>", "color": MUTED, "shrinkA": 0, "shrinkB": 0}
    for (right, up), name in zip(_VIEW.project(length * np.eye(3)), "xyz", strict=True):
        axes.annotate("", (x + right, y + up), (x, y), arrowprops=arrow, annotation_clip=False)
        axes.annotate(name, (x + 1.25 * right, y + 1.25 * up), **style)
    axes.annotate(f"{length:g} mm", (x, y), (0, -12), textcoords="offset points", **style)
