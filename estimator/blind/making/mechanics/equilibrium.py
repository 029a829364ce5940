"""Equilibrium of a held body at one pose of the gripper after another, by Newton's method."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.mechanics.body import Body
from estimator.blind.making.mechanics.factor import FreeStiffness, NotPositiveDefiniteError
from estimator.blind.making.mechanics.holding import HeldBody, Pose
from estimator.blind.making.mechanics.laws import InvertedError
from estimator.blind.making.mechanics.response import Instant, Memory, at_rest, respond, rested
from estimator.errors import SolverError

FloatArray = NDArray[np.float64]

_TOLERANCE_N = 2e-6
_MOST_ITERATIONS = 16
_SMALLEST_STEP = 1 / 32
# Of the shear modulus: enough that cells cannot take on shapes without strain, too little to be felt in the solution.
_HOURGLASS_SHARE = 0.1


@dataclass(frozen=True, slots=True)
class State:
    """An equilibrium.

    Attributes
    ----------
    pose : of the gripper
    u : (n, 3) displacements, m
    offset : (6,) of the held tissue in the gripper's frame
    wrench : (6,) that the tissue exerts on the gripper, in the tissue frame, about the gripper's origin
    memory, face_memories, grip_memory : histories
    load : share of the body force
    """

    pose: Pose
    u: FloatArray
    offset: FloatArray
    wrench: FloatArray
    memory: Memory
    face_memories: tuple[FloatArray, ...]
    grip_memory: FloatArray
    load: float


class Solver:
    """Finds equilibria of one held body; ``iterations`` counts Newton's steps."""

    def __init__(self, held: HeldBody) -> None:
        self.held = held
        self.iterations = 0
        free = np.repeat(~(held.fixed | held.gripped), 3)
        self._free = free
        self._gripped = np.repeat(held.gripped, 3)
        self._stiffness = FreeStiffness(held.body.dofs, free)
        self._control = _hourglass_control(held)
        self._weight = (_nodal_volumes(held.body, held.heavy)[:, None] * held.body_force).reshape(-1)

    @property
    def unknowns(self) -> int:
        """Number of free degrees of freedom."""
        return self._stiffness.size

    def rest(self) -> State:
        """Return the natural state, without load."""
        held = self.held
        return State(
            held.rest,
            np.zeros_like(held.body.mesh.points),
            np.zeros(6),
            np.zeros(6),
            at_rest(held.material),
            tuple(face.traction.start(face.face.areas.size) for face in held.faces),
            held.grip.start() if held.grip else np.zeros(0),
            0.0,
        )

    def after_rest(self, state: State) -> State:
        """Return the state after a long rest and a new grasp: what changed for good stays, in material and faces."""
        return replace(
            self.rest(), memory=rested(self.held.material, state.memory), face_memories=state.face_memories
        )

    def advance(
        self, state: State, pose: Pose, instant: Instant, load: float = 1.0, guess: FloatArray | None = None
    ) -> State:
        """Return the equilibrium at a pose, by as many intermediate ones as it takes.

        Raises
        ------
        SolverError
            Even a very small step finds none.
        """
        if guess is not None:
            try:
                return self._newton(state, pose, instant, load, guess)
            except (InvertedError, NotPositiveDefiniteError, _DivergedError):
                pass
        start, done, step = state, 0.0, 1.0
        while done < 1.0:
            step = min(step, 1.0 - done)
            share = done + step
            part = replace(
                instant, time=instant.time - (1 - share) * instant.interval, interval=step * instant.interval
            )
            try:
                state = self._newton(
                    state,
                    start.pose.towards(pose, share),
                    part,
                    start.load + share * (load - start.load),
                    None,
                )
            except (InvertedError, NotPositiveDefiniteError, _DivergedError) as error:
                step /= 2
                if step < _SMALLEST_STEP:
                    raise SolverError(
                        f"no equilibrium at {instant.time:.2f} s ({error}); draw a smaller effect"
                    ) from None
                continue
            done = share
            step *= 2
        return state

    def _newton(
        self, state: State, pose: Pose, instant: Instant, load: float, guess: FloatArray | None
    ) -> State:
        offset = state.offset
        u = state.u if guess is None else guess.copy()
        goal = self.held.held_displacements(pose, offset)
        move = np.zeros_like(u)
        if guess is None:
            move[self.held.gripped] = goal - u[self.held.gripped]
        else:
            u[self.held.gripped] = goal
        before, helped = np.inf, False
        for iteration in range(_MOST_ITERATIONS):
            forces, tangent, histories = self._loads(u, state, instant, load)
            held_force = forces[self._gripped]
            residual = forces[self._free]
            gap, slope, grip_memory = np.zeros(6), np.zeros((6, 6)), state.grip_memory
            levers = self.held.levers(pose, offset)
            if self.held.grip is not None:
                law, slope, grip_memory = self.held.grip(offset, state.grip_memory, instant.interval)
                gap = levers.T @ held_force + law
                if iteration == 0:
                    # Whether it slides on or sticks is not known yet, and a wrong guess of sliding does not mend.
                    slope = self.held.grip.holding()
            size = float(np.hypot(np.linalg.norm(residual), np.linalg.norm(gap)))
            if not np.any(move) and size < _TOLERANCE_N:
                if helped:
                    # It must be stable where it ends: this raises where it is not.
                    self._stiffness.factorise(tangent(True))
                wrench = self.held.wrench(pose, u, held_force)
                return State(pose, u, offset, wrench, *histories, grip_memory, load)
            if not np.isfinite(size) or size > 1e3 * max(before, 1.0):
                raise _DivergedError("the residual grows")
            before = size
            self.iterations += 1
            stiffness, stable = self._factorised(tangent)
            helped = helped or not stable
            right = residual
            if np.any(move):
                moved = self._product(stiffness, move.reshape(-1))
                right = right + moved[self._free]
                gap = gap + levers.T @ moved[self._gripped]
            change = np.zeros(u.size)
            if self.held.grip is None:
                change[self._free] = -self._stiffness.solve(right)
            else:
                offset, change = self._with_grip(stiffness, right, gap, slope, levers, offset)
            u = u + change.reshape(u.shape)
            # The held nodes go where the pose and the offset put them, exactly.
            u[self.held.gripped] = self.held.held_displacements(pose, offset)
            move = np.zeros_like(u)
        raise _DivergedError(f"{_MOST_ITERATIONS} iterations were not enough")

    def _factorised(self, tangent: Callable[[bool], FloatArray]) -> tuple[FloatArray, bool]:
        """Factorise a tangent, and tell whether it was whole; far from equilibrium it may do without its stress."""
        stiffness = tangent(True)
        try:
            self._stiffness.factorise(stiffness)
        except NotPositiveDefiniteError:
            stiffness = tangent(False)
            self._stiffness.factorise(stiffness)
            return stiffness, False
        return stiffness, True

    def _with_grip(
        self,
        stiffness: FloatArray,
        right: FloatArray,
        gap: FloatArray,
        slope: FloatArray,
        levers: FloatArray,
        offset: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Solve for free displacements and offset together, by the Schur complement of the offset."""
        spread = np.zeros((len(self._free), 6))
        spread[self._gripped] = levers
        pulled = np.column_stack([self._product(stiffness, column) for column in spread.T])
        solved = self._stiffness.solve(np.column_stack([right, pulled[self._free]]))
        own = spread.T @ pulled + slope - pulled[self._free].T @ solved[:, 1:]
        turn = -np.linalg.solve(own, gap - pulled[self._free].T @ solved[:, 0])
        change = np.zeros(len(self._free))
        change[self._free] = -solved[:, 0] - solved[:, 1:] @ turn
        return offset + turn, change

    def _loads(
        self, u: FloatArray, state: State, instant: Instant, load: float
    ) -> tuple[FloatArray, Callable[[bool], FloatArray], tuple[Memory, tuple[FloatArray, ...]]]:
        """Return nodal forces, what makes the cells' tangents with or without stress, and the histories if kept."""
        body = self.held.body
        strain = body.strain(u)
        if not np.all(np.linalg.det(strain.F) > 0):
            raise InvertedError("material is turned inside out")
        S, D, memory = respond(self.held.material, strain.C, state.memory, instant)
        cell_forces = body.internal_forces(strain, S)
        cell_forces += np.matmul(self._control, u[body.mesh.cells]).reshape(cell_forces.shape)
        face_memories, face_tangents = [], []
        for face, before in zip(self.held.faces, state.face_memories, strict=True):
            cells = face.face.cells
            face_forces, face_tangent, after = face.loads(u[body.mesh.cells[cells]], before, instant)
            cell_forces[cells] += face_forces
            face_tangents.append((cells, face_tangent))
            face_memories.append(after)

        def tangent(stressed: bool) -> FloatArray:
            stiffness = body.stiffness(strain, S if stressed else np.zeros_like(S), D)
            blocks = stiffness.reshape(len(stiffness), 20, 3, 20, 3)
            for axis in range(3):
                blocks[:, :, axis, :, axis] += self._control
            for cells, addition in face_tangents:
                stiffness[cells] += addition
            return stiffness

        forces = np.bincount(body.dofs.reshape(-1), cell_forces.reshape(-1), u.size) - load * self._weight
        return forces, tangent, (memory, tuple(face_memories))

    def _product(self, stiffness: FloatArray, vector: FloatArray) -> FloatArray:
        dofs = self.held.body.dofs
        cells = np.matmul(stiffness, vector[dofs][:, :, None])[:, :, 0]
        return np.bincount(dofs.reshape(-1), cells.reshape(-1), len(vector)).astype(np.float64)


class _DivergedError(ArithmeticError):
    """Newton's method does not converge; take a smaller step."""


def _hourglass_control(held: HeldBody) -> FloatArray:
    """Return a weak stiffness, (e, 20, 20) N/m for each axis, against what the reduced quadrature does not see."""
    law = held.material.law
    softest = held.material.stiffness.reshape(len(held.body.mesh.cells), -1).min(axis=1)
    shear = law.youngs_modulus / (2 * (1 + law.poisson_ratio)) * softest
    return _HOURGLASS_SHARE * shear[:, None, None] * held.body.unseen_gradients


def _nodal_volumes(body: Body, heavy: FloatArray | None) -> FloatArray:
    """Return the integral of each node's shape function, (n,) m³; corner nodes' are negative.

    ``heavy`` (e·q,) weighs the quadrature points; None: all alike.
    """
    quadrature, mesh = body.quadrature, body.mesh
    volumes = (
        quadrature.volumes if heavy is None else quadrature.volumes * heavy.reshape(quadrature.volumes.shape)
    )
    cells = np.einsum("eq,qn->en", volumes, body.shapes)
    return np.bincount(mesh.cells.reshape(-1), cells.reshape(-1), len(mesh.points)).astype(np.float64)


def along(history: Sequence[tuple[float, FloatArray]], place: float) -> FloatArray | None:
    """Extrapolate displacements to a place on a path, by up to three states before; None where there is but one."""
    known = list(history)[-3:]
    if len(known) < 2:
        return None
    places = [p for p, _ in known]
    result = np.zeros_like(known[0][1])
    for i, (own, u) in enumerate(known):
        weight = np.prod([(place - p) / (own - p) for j, p in enumerate(places) if j != i])
        result += weight * u
    return result
