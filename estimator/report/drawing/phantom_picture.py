"""A picture of a segmented phantom: its surface, what lies in it, and how it was registered."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection  # type: ignore[import-untyped]  # no types
from numpy.typing import NDArray

from estimator.report.theme import INK, LINE, MEASURED, PREDICTED, TRUTH
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

_VIEWS = ((28.0, -60.0), (28.0, 30.0))
_LIGHT = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
_TISSUE = "#d8c3b4"
_REGIONS = (PREDICTED, MEASURED, TRUTH)
# More triangles than this are thinned out of what is drawn translucent: the picture is one of the shape.
_MOST = 20_000


def draw_phantom(
    surface: Surface,
    regions: Mapping[str, Surface],
    pairs: tuple[FloatArray, FloatArray] | None,
    title: str,
    file: Path | str,
) -> None:
    """Draw a phantom from two sides as PNG.

    Parameters
    ----------
    surface : of the tissue, with cavities; translucent, so that these and the regions are seen
    regions : surfaces, by name
    pairs : points (n, 3) of a registration and where they came to lie, m; None where there was none
    title : what the frame is and how good the surface
    file : to write, over any that is there
    """
    figure = Figure(figsize=(12.0, 5.8), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=10)
    for place, (elevation, azimuth) in enumerate(_VIEWS, start=1):
        axes = figure.add_subplot(1, len(_VIEWS), place, projection="3d")
        axes.add_collection3d(_faces(surface, _TISSUE, 0.35 if regions or pairs is not None else 0.9))
        for one, colour in zip(regions.values(), _colours(regions), strict=True):
            axes.add_collection3d(_faces(one, colour, 0.9))
        if pairs is not None:
            wanted, reached = (1e3 * points[:: max(1, len(points) // 500)] for points in pairs)
            axes.scatter(*wanted.T, s=10, color=MEASURED, depthshade=False)
            axes.add_collection3d(Line3DCollection(np.stack([wanted, reached], axis=1), colors=PREDICTED))
        lower, upper = 1e3 * surface.bounds
        axes.set(xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)")
        axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]), zlim=(lower[2], upper[2]))
        axes.set_box_aspect(upper - lower)
        axes.view_init(elevation, azimuth)
    keys = [
        Patch(facecolor=colour, edgecolor=LINE, label=name)
        for name, colour in zip(regions, _colours(regions), strict=True)
    ]
    if pairs is not None:
        keys.append(
            Patch(facecolor=MEASURED, edgecolor=LINE, label="points of the registration, and how far off")
        )
    if keys:
        figure.legend(handles=keys, loc="outside lower center", ncols=len(keys), frameon=False)
    figure.savefig(file, dpi=110, format="png")


def _colours(regions: Mapping[str, Surface]) -> list[str]:
    return [_REGIONS[number % len(_REGIONS)] for number in range(len(regions))]


def _faces(surface: Surface, colour: str, opacity: float) -> Poly3DCollection:
    some = slice(None, None, -(-len(surface.triangles) // _MOST))
    normals = surface.area_vectors[some] / surface.areas[some, None]
    shade = 0.7 + 0.3 * (normals @ _LIGHT)
    colours = np.column_stack([np.outer(shade, to_rgb(colour)), np.full(len(shade), opacity)])
    return Poly3DCollection(1e3 * surface.corners[some], facecolors=colours, edgecolors=(*to_rgb(INK), 0.03))
