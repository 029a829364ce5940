"""What CalculiX writes into its .dat file: displacements of the tissue's nodes and forces that hold the grasp."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import SolverError
from estimator.fem.discretisation.mesh import Mesh
from estimator.handover.answer import EngineAnswer, wrench_of
from estimator.handover.calculix.deck import middles, numbering_of
from estimator.handover.model import HandedOver, Run

FloatArray = NDArray[np.float64]

# " displacements (vx,vy,vz) for set TISSUE and time  0.1000000E+01"
_HEAD = re.compile(r"^\s*(displacements|forces) .* for set (\w+) and time\s+(\S+)")
# Times are written with seven digits.
_SAME_TIME = 1e-5


def read_blocks(lines: Iterable[str]) -> dict[tuple[str, int], dict[int, list[float]]]:
    """Return the vectors by node of each kind and step, at the end of the step; each step lasts one second."""
    blocks: dict[tuple[str, int], dict[int, list[float]]] = {}
    present: dict[int, list[float]] = {}
    for line in lines:
        head = _HEAD.match(line)
        if head:
            time, present = float(head[3]), {}
            if abs(time - round(time)) < _SAME_TIME * max(time, 1.0):
                blocks[head[1], round(time) - 1] = present
        elif line.strip():
            node, *values = line.split()
            present[int(node)] = [float(value) for value in values]
    return blocks


def read_answer(path: Path, handed: HandedOver, run: Run, seconds: float) -> EngineAnswer:
    """Return an engine's answer.

    Raises
    ------
    SolverError
        The file ends before the motion does.
    """
    with path.open(encoding="ascii", errors="replace") as file:
        blocks = read_blocks(file)
    problem, mesh = handed.problem, handed.problem.body.mesh
    nodes = numbering_of(mesh).nodes
    wrench, beads = [], []
    for step, pose in enumerate(run.poses):
        moved, held = blocks.get(("displacements", step)), blocks.get(("forces", step))
        if moved is None or held is None:
            raise SolverError(
                f"{path}: ends before step {step + 1} of {len(run.poses)}; see the .sta file beside it"
            )
        displacement = np.zeros_like(mesh.points)
        displacement[nodes[np.array(list(moved)) - 1]] = list(moved.values())
        displacement = with_middles(displacement, mesh)
        gripped = nodes[np.array(list(held)) - 1]
        reaction = np.array(list(held.values()))
        wrench.append(wrench_of(reaction, mesh.points[gripped] + displacement[gripped], pose))
        beads.append(problem.fiducial_positions(displacement, pose))
    return EngineAnswer(np.array(wrench), np.array(beads), seconds)


def with_middles(displacement: FloatArray, mesh: Mesh) -> FloatArray:
    """Return nodal displacements (n, 3), those of nodes that CalculiX lacks as its elements interpolate them."""
    found = displacement.copy()
    if mesh.kind == "hex27":
        for middle, weights in middles():
            around = sum(weight * displacement[mesh.cells[:, local]] for local, weight in weights.items())
            found[mesh.cells[:, middle]] = around
    return found
