"""What the sensors see of an equilibrium, and how it changes with every parameter.

At equilibrium the free nodal forces vanish, f_f(u, p) = 0. Differentiated, that gives for any parameter p and for the
motion of the gripper

    K_ff ∂u_f/∂p = −∂f_f/∂p,        ∂f_g/∂p |total = ∂f_g/∂p + K_gf ∂u_f/∂p:

one back-substitution a parameter with the factor at hand (Michaleris, Tortorelli & Vidal 1994, section 2).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.fem.assembly.body import nodal_forces, slopes_by_parameter
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.grip import wrench_by_forces, wrench_by_pose, wrench_of
from estimator.fem.equilibrium.rubbing import following, handed_on
from estimator.fem.equilibrium.state import EquilibriumState, rigid_modes, turned

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Observation:
    """The observables of one state.

    Attributes
    ----------
    wrench : (6,) force (N) and torque (N·m) that the tissue exerts on the gripper, about the gripper frame's origin
    fiducials : (m, 3) positions, m
    wrench_by, fiducials_by : derivatives by each material parameter, (6,) and (m, 3)
    wrench_by_pose : (6, 6) derivative by the gripper's translation (m) and rotation (rad)
    fiducials_by_pose : (m, 3, 6)
    field_by : derivative of the free displacements by each material parameter, (nf,)
    """

    wrench: FloatArray
    fiducials: FloatArray
    wrench_by: dict[str, FloatArray]
    fiducials_by: dict[str, FloatArray]
    wrench_by_pose: FloatArray
    fiducials_by_pose: FloatArray
    field_by: dict[str, FloatArray]


def observe(problem: RetractionProblem, state: EquilibriumState) -> Observation:
    """Return what the sensors see of ``state``, with exact derivatives."""
    slopes = slopes_by_parameter(state.material, state.response)
    free, gripped = problem.pattern.free, problem.pattern.gripped
    loads = {name: nodal_forces(problem.body, state.response, slope) for name, slope in slopes.items()}
    all_loads = np.stack([load.reshape(-1) for load in loads.values()], axis=1)
    all_loads = all_loads + following(state, all_loads)
    motions = -state.tangent.free.solve(all_loads[free])
    whole = np.zeros_like(all_loads)
    whole[free] = motions
    held = all_loads[gripped] + state.tangent.gripped_free @ motions
    wrenches = wrench_by_forces(problem, state, held, whole, rubbed=handed_on(problem, state, whole, held))
    fiducials = interpolate(problem, whole)
    return Observation(
        wrench_of(problem, state),
        problem.fiducial_positions(state.displacement, state.pose),
        dict(zip(loads, wrenches.T, strict=True)),
        dict(zip(loads, np.moveaxis(fiducials, 2, 0), strict=True)),
        wrench_by_pose(problem, state),
        _fiducial_motion_by_pose(problem, state),
        dict(zip(loads, motions.T, strict=True)),
    )


def at_modulus(observation: Observation, before: float, after: float) -> Observation:
    """Return the observation once Young's modulus has changed, Pa.

    Of tissue without weight that is exact: forces are proportional to the modulus, motions stay. Weight strains the
    tissue by its ratio to the modulus, and joins the forces: to first order in that ratio, the forces go linearly in
    the modulus, the motions in its inverse.
    """
    ratio, change = after / before, after - before
    wrench_by = {name: ratio * slope for name, slope in observation.wrench_by.items()}
    # The force per unit of the modulus is what it was.
    wrench_by["youngs_modulus"] = observation.wrench_by["youngs_modulus"]
    sagged = observation.fiducials_by["youngs_modulus"]
    return replace(
        observation,
        wrench=observation.wrench + change * observation.wrench_by["youngs_modulus"],
        fiducials=observation.fiducials + change / ratio * sagged,
        wrench_by=wrench_by,
        fiducials_by={**observation.fiducials_by, "youngs_modulus": sagged / ratio**2},
        wrench_by_pose=ratio * observation.wrench_by_pose,
    )


def zeroed(observation: Observation, rest: Observation, rotation: Rotation) -> Observation:
    """Return what a sensor reads that was zeroed, on its own axes, where it felt the wrench of ``rest``.

    Parameters
    ----------
    rotation : of the gripper since then
    """

    def turned_along(wrench: FloatArray) -> FloatArray:
        return np.asarray(rotation.apply(wrench.reshape(2, 3))).reshape(6)

    zero = turned_along(rest.wrench)
    by_pose = observation.wrench_by_pose.copy()
    by_pose[:, 3:] -= turned(zero.reshape(2, 3)).reshape(6, 3)
    return replace(
        observation,
        wrench=observation.wrench - zero,
        wrench_by={
            name: slope - turned_along(rest.wrench_by[name]) for name, slope in observation.wrench_by.items()
        },
        wrench_by_pose=by_pose,
    )


def _fiducial_motion_by_pose(problem: RetractionProblem, state: EquilibriumState) -> FloatArray:
    whole = np.zeros((problem.body.mesh.points.size, 6))
    whole[problem.pattern.free] = state.by_pose
    whole[problem.pattern.gripped] = rigid_modes(problem, state.pose)
    motion = interpolate(problem, whole)
    held = problem.fiducials_gripped
    arms = state.pose.rotation.apply(problem.gripped_fiducial_arms())
    motion[held, :, :3] = np.eye(3)
    motion[held, :, 3:] = turned(arms)
    return motion


def interpolate(problem: RetractionProblem, dofs: FloatArray) -> FloatArray:
    """Return the motion (m, 3, c) of the fiducials that no rigid tissue holds, from that of all nodes, (3n, c)."""
    nodal = dofs.reshape(len(dofs) // 3, 3, dofs.shape[1])
    return np.einsum("mk,mkxc->mxc", problem.fiducial_weights, nodal[problem.fiducial_nodes])
