"""A picture of a meshed phantom: its element faces, and where it is held."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]  # it carries no types
from numpy.typing import NDArray

from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.surface import boundary_faces
from estimator.report.theme import ANCHOR, GRASP, INK, LINE

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_VIEWS = ((28.0, -60.0), (-28.0, 120.0))
_LIGHT = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
_FREE = "#d8c3b4"


def draw_mesh(mesh: Mesh, held: Mapping[str, BoolArray], file: Path | str) -> None:
    """Draw the mesh from above and from below as PNG.

    Parameters
    ----------
    mesh : Mesh of tetrahedra
    held : the nodes (n,) of each region; those named "grasp" stand out from the others
    file : to write, over any that is there
    """
    corners = boundary_faces(mesh)[:, :3]
    triangles = mesh.points[corners]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colours = np.tile(to_rgb(_FREE), (len(corners), 1))
    for name, nodes in held.items():
        colours[nodes[corners].all(axis=1)] = to_rgb(_colour(name))
    lower, upper = mesh.points.min(axis=0), mesh.points.max(axis=0)
    figure = Figure(figsize=(12.0, 5.5), layout="constrained")
    FigureCanvasAgg(figure)
    for place, (elevation, azimuth) in enumerate(_VIEWS, start=1):
        axes = figure.add_subplot(1, len(_VIEWS), place, projection="3d")
        shade = 0.7 + 0.3 * (normals @ _LIGHT) * np.sign(elevation)
        faces = Poly3DCollection(
            1e3 * triangles, facecolors=colours * shade[:, None], edgecolors=INK, linewidths=0.2
        )
        axes.add_collection3d(faces)
        axes.set(xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)")
        axes.set_xlim(1e3 * lower[0], 1e3 * upper[0])
        axes.set_ylim(1e3 * lower[1], 1e3 * upper[1])
        axes.set_zlim(1e3 * lower[2], 1e3 * upper[2])
        axes.set_box_aspect(upper - lower)
        axes.view_init(elevation, azimuth)
    keys = [Patch(facecolor=_colour(name), edgecolor=LINE, label=name) for name in held]
    if keys:
        figure.legend(handles=keys, loc="outside lower center", ncols=len(keys), frameon=False)
    figure.savefig(file, dpi=120, format="png")


def _colour(name: str) -> str:
    return GRASP if name == "grasp" else ANCHOR
