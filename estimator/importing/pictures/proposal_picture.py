"""A picture of what was understood of a source, in its own axes: points with their names, path and forces."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from estimator.importing.mapping import POSITIONS
from estimator.importing.points import Point
from estimator.importing.proposing import Proposal, Proposed
from estimator.report.theme import GRASP, INK

_SIDES = ((0, 1), (0, 2), (1, 2))
_MOST_NAMED = 40


def draw_proposal(proposal: Proposal, file: Path) -> None:
    """Draw a proposal as PNG, over any file that is there."""
    figure = Figure(figsize=(13.0, 7.5))
    FigureCanvasAgg(figure)
    places = figure.subplots(2, 3)
    # a layout that is computed takes seconds
    figure.subplots_adjust(left=0.06, right=0.98, bottom=0.08, top=0.92, wspace=0.28, hspace=0.25)
    for axes, (across, up) in zip(places[0], _SIDES, strict=True):
        for point in proposal.beads:
            _draw_point(axes, point, across, up, INK)
        for point in proposal.gripper:
            _draw_point(axes, point, across, up, GRASP)
        axes.set(xlabel=f"{'xyz'[across]} of the source", ylabel=f"{'xyz'[up]} of the source")
        axes.set_aspect("equal", adjustable="datalim")
    channels = proposal.channels
    moves = [channels[name] for name in (*POSITIONS, "p") if name in channels]
    forces = [channels[name] for name in ("fx", "fy", "fz", "f") if name in channels]
    _draw_channels(places[1][0], moves, "motion")
    _draw_channels(places[1][1], forces, "force")
    _draw_response(places[1][2], moves, forces)
    figure.suptitle(f"{proposal.source.path.name}, as it is understood: {proposal.source.how}"[:150])
    figure.savefig(file, dpi=100, format="png")


def _draw_point(axes: Axes, point: Point, across: int, up: int, colour: str) -> None:
    x, y = point.columns[across], point.columns[up]
    if x is None or y is None:
        return
    axes.plot(x.values, y.values, color=colour, linewidth=0.6, alpha=0.6)
    start = point.start
    if np.isfinite(start[[across, up]]).all():
        axes.plot(start[across], start[up], "o", markersize=3, color=colour)
        if len(axes.texts) < _MOST_NAMED:
            axes.annotate(point.name[:20], (start[across], start[up]), fontsize=6, color=colour)


def _draw_channels(axes: Axes, channels: list[Proposed], what: str) -> None:
    for one in channels:
        axes.plot(one.column.values, linewidth=1.0, label=f"{one.target}: {one.name}"[:40])
    axes.set(xlabel="row", ylabel=what)
    if channels:
        axes.legend(frameon=False, fontsize="small")


def _draw_response(axes: Axes, moves: list[Proposed], forces: list[Proposed]) -> None:
    """Draw each force over the motion along its own axis."""
    for force in forces:
        for move in moves:
            if move.target[1:] == force.target[1:] and move.table.name == force.table.name:
                axes.plot(move.column.values, force.column.values, linewidth=1.0, label=force.target)
    axes.set(xlabel="motion", ylabel="force along it")
    if axes.lines:
        axes.legend(frameon=False, fontsize="small")
