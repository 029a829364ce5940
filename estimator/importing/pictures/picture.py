"""A picture of an experiment: the phantom with its grasp, anchors and beads from three sides, path and forces."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from estimator.experiment.holds import Box
from estimator.experiment.model import Experiment
from estimator.experiment.observations import WRENCH_COLUMNS
from estimator.experiment_checks.readings import body_box
from estimator.report.theme import ANCHOR, GRASP, INK

_SIDES = ((0, 2), (0, 1), (1, 2))
_MM = 1e3


def draw_experiment(experiment: Experiment, file: Path) -> None:
    """Draw an experiment as PNG, over any file that is there."""
    figure = Figure(figsize=(13.0, 7.5))
    FigureCanvasAgg(figure)
    places = figure.subplots(2, 3)
    # a layout that is computed takes seconds
    figure.subplots_adjust(left=0.06, right=0.98, bottom=0.08, top=0.92, wspace=0.28, hspace=0.25)
    body = body_box(experiment)
    for axes, (across, up) in zip(places[0], _SIDES, strict=True):
        _draw_side(axes, experiment, body, across, up)
    places[0][0].legend(loc="upper left", fontsize="small", frameon=False)
    _draw_motion(places[1][0], experiment)
    _draw_forces(places[1][1], experiment)
    _draw_response(places[1][2], experiment)
    figure.suptitle(
        f"{experiment.name} ({len(experiment.time)} rows, {len(experiment.fiducials_rest)} beads)"
    )
    figure.savefig(file, dpi=110, format="png")


def _draw_side(axes: Axes, experiment: Experiment, body: Box, across: int, up: int) -> None:
    _draw_box(axes, body, across, up, edgecolor=INK, facecolor="none", label="phantom")
    for number, anchor in enumerate(experiment.anchors):
        shown = anchor.intersection(body) or anchor
        _draw_box(axes, shown, across, up, color=ANCHOR, alpha=0.5, label="" if number else "anchor")
    for number, roller in enumerate(experiment.rollers):
        shown = roller.box.intersection(body) or roller.box
        _draw_box(axes, shown, across, up, color=ANCHOR, alpha=0.2, label="" if number else "roller")
    held = experiment.grasp.box.intersection(body) or experiment.grasp.box
    _draw_box(axes, held, across, up, color=GRASP, alpha=0.5, label="grasp")
    rest, seen = _MM * experiment.fiducials_rest, _MM * experiment.fiducials
    for bead in range(len(rest)):
        axes.plot(seen[:, bead, across], seen[:, bead, up], color=INK, linewidth=0.6, alpha=0.6)
    axes.plot(rest[:, across], rest[:, up], "o", markersize=3, color=INK, label="beads at rest")
    path = _MM * experiment.position
    axes.plot(path[:, across], path[:, up], ".-", color=GRASP, markersize=4, label="gripper")
    axes.set(xlabel=f"{'xyz'[across]} (mm)", ylabel=f"{'xyz'[up]} (mm)")
    axes.set_aspect("equal", adjustable="datalim")


def _draw_box(axes: Axes, box: Box, across: int, up: int, label: str, **style: object) -> None:
    lower, upper = _MM * np.array(box.lower), _MM * np.array(box.upper)
    corner, size = (lower[across], lower[up]), upper - lower
    axes.add_patch(Rectangle(corner, size[across], size[up], label=label, **style))  # type: ignore[arg-type]
    axes.update_datalim([(lower[across], lower[up]), (upper[across], upper[up])])
    axes.autoscale_view()


def _draw_motion(axes: Axes, experiment: Experiment) -> None:
    moved = _MM * (experiment.position - experiment.position[0])
    for axis in range(3):
        axes.plot(experiment.time, moved[:, axis], ".-", label="xyz"[axis], markersize=3)
    axes.set(xlabel="time (s)", ylabel="travel of the gripper (mm)")
    axes.legend(frameon=False)


def _draw_forces(axes: Axes, experiment: Experiment) -> None:
    for axis in range(3):
        if np.isfinite(experiment.wrench[:, axis]).any():
            axes.plot(
                experiment.time, experiment.wrench[:, axis], ".-", label=WRENCH_COLUMNS[axis], markersize=3
            )
    axes.set(xlabel="time (s)", ylabel="force of the tissue on the gripper (N)")
    if axes.lines:
        axes.legend(frameon=False)


def _draw_response(axes: Axes, experiment: Experiment) -> None:
    """Draw the force against the motion over the travel along it."""
    moved = experiment.position - experiment.position[0]
    way = moved[int(np.argmax(np.linalg.norm(moved, axis=1)))]
    length = float(np.linalg.norm(way))
    if length > 0:
        known = np.isfinite(experiment.wrench[:, :3])
        force = np.where(known, experiment.wrench[:, :3], 0.0)
        axes.plot(_MM * moved @ way / length, -force @ way / length, ".-", color=INK, markersize=3)
    axes.set(xlabel="travel along the motion (mm)", ylabel="force against it (N)")
