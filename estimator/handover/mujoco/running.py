"""Follow the motion in MuJoCo through states of rest, and read the tissue's wrench on the gripper.

Between two poses the gripper moves in small pieces. After each the tissue is let come to rest: it moves freely until
its kinetic energy has a maximum, is stopped there, and so on (dynamic relaxation with kinetic damping, P. A. Cundall,
1976).
The gripper's own joint carries what the tissue pulls with, for its vertices belong to it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.errors import SolverError
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.handover.answer import EngineAnswer
from estimator.handover.model import Run
from estimator.handover.mujoco.mjcf import GRIPPER, lumped_masses, sizes, vertex_name
from estimator.handover.mujoco.tetrahedra import linear_tetrahedra

FloatArray = NDArray[np.float64]

# The longest piece of the gripper's way, m; a turn counts by what it moves 10 mm away.
_PIECE_M, _LEVER_M = 5e-4, 0.01
# At rest what is left on a vertex is below this share of the largest force on the gripper, or of so much.
_AT_REST, _NO_FORCE_N = 1e-4, 1e-3
_STEPS_ON_THE_WAY, _MOST_STEPS = 20, 20000


def follow(
    mujoco: ModuleType, path: Path, run: Run, problem: RetractionProblem, progress: Callable[[int], None]
) -> EngineAnswer:
    """Return MuJoCo's answer to an experiment's motion.

    Raises
    ------
    SolverError
        The tissue does not come to rest, or flies apart.
    """
    started = time.perf_counter()
    model = mujoco.MjModel.from_xml_path(str(path))
    # What stands still and the gripper, whose pose is given, need no constraint.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    weights = _even_masses(model, problem)
    data = mujoco.MjData(model)
    held = np.arange(6) + int(model.joint(model.body(GRIPPER).jntadr[0]).dofadr[0])
    last = GripperPose(problem.grasp_centre, run.poses[0].rotation * run.poses[0].rotation.inv())
    largest = max(float(np.linalg.norm(run.wrench[:, :3], axis=1).max()), _NO_FORCE_N)
    wrench, beads = [], []
    for number, pose in enumerate(run.poses):
        progress(number)
        move = last.increment_to(pose)
        way = max(float(np.linalg.norm(move[:3])), _LEVER_M * float(np.linalg.norm(move[3:])))
        pieces = max(1, int(np.ceil(way / _PIECE_M)))
        for piece in range(1, pieces + 1):
            _place(model, data, last.between(pose, piece / pieces))
            most = _MOST_STEPS if piece == pieces else _STEPS_ON_THE_WAY
            _relax(_Relaxing(mujoco, model, data, held, weights, _AT_REST * largest), most)
        # the last step has moved the tissue a little since its forces were judged
        if not _rests(data, held, 3 * _AT_REST * largest):
            raise SolverError(f"MuJoCo: the tissue does not come to rest at load step {number + 1}")
        last = pose
        wrench.append(_wrench(data, held, pose))
        displacement = np.array(data.flexvert_xpos) - problem.body.mesh.points
        beads.append(problem.fiducial_positions(displacement, pose))
    return EngineAnswer(np.array(wrench), np.array(beads), time.perf_counter() - started)


def _place(model: Any, data: Any, pose: GripperPose) -> None:
    address = int(model.joint(model.body(GRIPPER).jntadr[0]).qposadr[0])
    data.qpos[address : address + 3] = pose.position
    data.qpos[address + 3 : address + 7] = pose.rotation.as_quat(scalar_first=True)
    data.mocap_pos[0] = pose.position
    data.mocap_quat[0] = pose.rotation.as_quat(scalar_first=True)


@dataclass(frozen=True)
class _Relaxing:
    mujoco: ModuleType
    model: Any
    data: Any
    held: NDArray[np.int64]
    weights: FloatArray
    at_rest_n: float


def _even_masses(model: Any, problem: RetractionProblem) -> FloatArray:
    """Give every tetrahedron the density with which a wave takes as long through it; return the mass of each slide.

    At rest masses say nothing, and the tissue comes to rest sooner.
    """
    mesh = problem.body.mesh
    tetrahedra = linear_tetrahedra(mesh)
    volume, height = sizes(mesh.points, tetrahedra)
    loose = np.flatnonzero(~(problem.fixed | problem.gripped))
    bodies = np.array([model.body(vertex_name(int(node))).id for node in loose])
    density = model.body_mass[bodies].sum() / lumped_masses(len(mesh.points), tetrahedra, volume)[loose].sum()
    even = density * volume * (height.min() / height) ** 2
    model.body_mass[bodies] = lumped_masses(len(mesh.points), tetrahedra, even)[loose]
    weights = np.array(model.body_mass[model.dof_bodyid])
    weights[:6] = 0.0
    return weights


def _relax(one: _Relaxing, most: int) -> None:
    """Let the tissue come to rest while the gripper stands."""
    data = one.data
    gripper = np.array(data.qpos[:7])
    data.qvel[:] = 0.0
    before = 0.0
    for _ in range(most):
        one.mujoco.mj_step(one.model, data)
        data.qpos[:7], data.qvel[one.held] = gripper, 0.0
        if not np.isfinite(data.qvel).all():
            raise SolverError("MuJoCo: the tissue flies apart; its time step is too long for this mesh")
        energy = float(one.weights @ np.square(data.qvel))
        if energy < before:
            data.qvel[:] = 0.0
            energy = 0.0
            if _rests(data, one.held, one.at_rest_n):
                break
        before = energy
    one.mujoco.mj_forward(one.model, data)


def _rests(data: Any, held: NDArray[np.int64], at_rest_n: float) -> bool:
    return float(np.abs(np.delete(data.qfrc_spring, held)).max()) < at_rest_n


def _wrench(data: Any, held: NDArray[np.int64], pose: GripperPose) -> FloatArray:
    """Return force and torque about the gripper's origin; a free joint has its torque in the body's own axes."""
    passive = np.array(data.qfrc_spring[held])
    return np.concatenate([passive[:3], pose.rotation.apply(passive[3:])])
