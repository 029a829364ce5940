"""Static equilibrium under a given motion of the gripper, by Newton's method with automatic cutback."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.errors import SolverError
from estimator.fem.assembly.body import Response, nodal_forces, pressure_after, respond, stiffness
from estimator.fem.assembly.tangent import Tangent, TangentAssembler
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.rubbing import load_by_pose, with_rubbing
from estimator.fem.equilibrium.state import EquilibriumState, Waypoint, curvature, linear_change
from estimator.fem.terms.rubbing import carried_to, summed_rubbing, that_rub
from estimator.fem.terms.term import Term, TermStiffness, summed_stiffness
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# Rounding of the nodal forces, relative to the stiffest modulus times the body's cross-section.
_ROUNDING = 1e-14


@dataclass(frozen=True)
class NewtonSettings:
    """When Newton's iteration ends and how far a step may be cut.

    The residual counts as zero below ``tolerance`` times the norm of the gripping forces. The tangent is renewed
    where a correction has lowered the residual by less than ``chord_rate``. An indefinite tangent mostly means too
    long a step; it is followed only in steps of ``unstable_fraction`` or less, where the equilibrium is unstable.
    Where the last tangent was assembled at a residual below ``tangent_reuse`` times the gripping forces, it serves as
    the solution's.
    """

    tolerance: float = 1e-9
    iterations: int = 20
    chord_rate: float = 0.15
    smallest_fraction: float = 1.0 / 256.0
    unstable_fraction: float = 1.0 / 16.0
    tangent_reuse: float = 0.0


class EquilibriumSolver:
    """Solves one retraction problem for any material and motion; keeps the symbolic factorisation between calls."""

    def __init__(self, problem: RetractionProblem, settings: NewtonSettings | None = None) -> None:
        self.problem = problem
        self.settings = settings or NewtonSettings()
        self._weight = problem.weight
        self._assembler = TangentAssembler(problem.pattern)

    def with_settings(self, settings: NewtonSettings) -> EquilibriumSolver:
        """Return a solver with other settings that shares the symbolic factorisation."""
        other = copy(self)
        other.settings = settings
        return other

    def under_weight(self, share: float) -> EquilibriumSolver:
        """Return a solver for tissue with a share of its weight that shares the symbolic factorisation."""
        other = copy(self)
        other._weight = share * self.problem.weight
        return other

    def rest(self, material: Material, terms: tuple[Term, ...] = ()) -> EquilibriumState:
        """Return the unloaded state; no term acts but by sticking, nor the tissue's weight."""
        pose = GripperPose.from_quaternion(self.problem.grasp_centre, np.array([1.0, 0, 0, 0]))
        body = self.problem.body
        unloaded = self.under_weight(0.0)
        trial = unloaded._trial(
            material, that_rub(terms), np.zeros_like(body.mesh.points), np.zeros(body.volume.shape)
        )
        return unloaded._finish(trial, pose, 0)

    def solve(
        self, pose: GripperPose, material: Material, start: EquilibriumState, terms: tuple[Term, ...] = ()
    ) -> EquilibriumState:
        """Return the equilibrium at ``pose``, approached from ``start`` in one step or, where that fails, in several.

        The terms and the weight act in full from the first step on.

        Raises
        ------
        SolverError
            Equilibrium could not be reached even in the smallest permitted steps; the message tells how far it came.
        """
        reached, fraction, step = start, 0.0, 1.0
        while fraction < 1.0:
            target = min(1.0, fraction + step)
            goal = pose if target == 1.0 else start.pose.between(pose, target)
            try:
                trial = self._predict(goal, material, reached, terms)
                state = self._newton(goal, trial, accept_unstable=step <= self.settings.unstable_fraction)
            except SolverError as failure:
                step /= 2.0
                if step < self.settings.smallest_fraction:
                    raise SolverError(
                        f"no equilibrium beyond {100 * fraction:.0f} % of the motion to "
                        f"{np.round(1e3 * pose.position, 2).tolist()} mm: {failure}"
                    ) from failure
                continue
            reached = replace(state, before=Waypoint(reached.pose, reached.displacement, reached.by_pose))
            fraction, step = target, min(2.0 * step, 1.0)
        return reached

    def refine(
        self,
        pose: GripperPose,
        material: Material,
        guess: FloatArray,
        pressure: FloatArray,
        terms: tuple[Term, ...] = (),
        tangent: Tangent | None = None,
    ) -> EquilibriumState:
        """Return the equilibrium near a guess.

        Parameters
        ----------
        guess : (n, 3) displacements, m; gripped nodes are set to the pose
        pressure : (e, q) λ·(projected J − 1) near that equilibrium, Pa
        terms : forces on the tissue besides its own stress
        tangent : of a state that hardly differs; it is renewed where it does not lead there

        Raises
        ------
        SolverError
            The iteration does not converge from there.
        """
        carried = carried_to(pose.position, pose.rotation, terms)
        trial = self._trial(material, carried, self.problem.imposed(guess, pose), pressure)
        return self._newton(pose, trial, accept_unstable=False, tangent=tangent)

    def _newton(
        self, pose: GripperPose, trial: _Trial, *, accept_unstable: bool, tangent: Tangent | None = None
    ) -> EquilibriumState:
        size = self._residual(trial)
        size_at_tangent = size if tangent is None else 0.0
        for iteration in range(self.settings.iterations + 1):
            if size <= self._smallest_residual(trial):
                if size_at_tangent > self.settings.tangent_reuse * self._reaction(trial):
                    tangent = None  # let go of, so that the solution's takes its memory
                return self._finish(trial, pose, iteration, tangent)
            if tangent is None:
                tangent, size_at_tangent = self._assemble(trial), size
                if not (tangent.positive_definite or accept_unstable):
                    raise SolverError("the tissue is unstable on the way")
            trial, previous = self._correct(trial, tangent), size
            size = self._residual(trial)
            if size > self.settings.chord_rate * previous:
                tangent = None
        raise SolverError(f"Newton's method did not converge in {self.settings.iterations} iterations")

    def _predict(
        self, pose: GripperPose, material: Material, start: EquilibriumState, terms: tuple[Term, ...]
    ) -> _Trial:
        """Extrapolate the field along the motion; where that turns an element, move the gripped nodes alone.

        The pressure follows the linear change alone: that one keeps the volume to first order, so that the pressure
        changes as it does along the equilibria, while λ would magnify what a curved change adds to the volume.
        """
        motion = start.pose.increment_to(pose)
        linear = linear_change(self.problem, start, motion)
        terms = carried_to(pose.position, pose.rotation, terms)
        pressure = pressure_after(self.problem.body, material, start.response, linear)
        curved = linear.copy().reshape(-1)
        curved[self.problem.pattern.free] += curvature(self.problem, start, motion)
        for change in (curved.reshape(linear.shape), np.zeros_like(linear)):
            try:
                moved = self.problem.imposed(start.displacement + change, pose)
                return self._trial(material, terms, moved, pressure)
            except SolverError as turned:
                failure = turned
        raise failure

    def _correct(self, trial: _Trial, tangent: Tangent) -> _Trial:
        """Return the trial after a Newton correction, shortened until the residual falls and no element turns."""
        free = self.problem.pattern.free
        correction: FloatArray = np.zeros(trial.displacement.size)
        correction[free] = -tangent.free.solve(trial.forces.reshape(-1)[free])
        correction = correction.reshape(trial.displacement.shape)
        size, share = self._residual(trial), 1.0
        while share > 1e-3:
            try:
                change = share * correction
                pressure = pressure_after(self.problem.body, trial.material, trial.response, change)
                moved = trial.displacement + change
                shortened = self._trial(trial.material, trial.terms, moved, pressure)
            except SolverError:
                share /= 2.0
                continue
            if self._residual(shortened) < (1.0 - 1e-4 * share) * size or share < 0.1:
                return shortened
            share /= 2.0
        raise SolverError("every correction turns an element inside out")

    def _trial(
        self, material: Material, terms: tuple[Term, ...], displacement: FloatArray, pressure: FloatArray
    ) -> _Trial:
        response = respond(self.problem.body, material, displacement)
        forces = nodal_forces(self.problem.body, response, response.slope) - self._weight
        for term in terms:
            forces = forces + term.forces(displacement, response)
        return _Trial(material, terms, displacement, response, forces, pressure)

    def _residual(self, trial: _Trial) -> float:
        return float(np.linalg.norm(trial.forces.reshape(-1)[self.problem.pattern.free]))

    def _reaction(self, trial: _Trial) -> float:
        return float(np.linalg.norm(trial.forces[self.problem.gripped]))

    def _smallest_residual(self, trial: _Trial) -> float:
        """Return the residual that counts as zero: a share of the gripping forces, or what rounding leaves."""
        mu, lame = trial.material.lame
        area = float(self.problem.body.volume.sum()) ** (2 / 3)
        return max(self.settings.tolerance * self._reaction(trial), _ROUNDING * (lame + 2 * mu) * area)

    def _assemble(self, trial: _Trial) -> Tangent:
        of_terms = summed_stiffness(trial.terms, trial.displacement, trial.response)
        rubbing = summed_rubbing(trial.terms, trial.displacement, trial.response)
        # No name is kept for the elements' matrices: they are the most memory beside the factor, which comes next.
        tangent = self._assembler.assemble(self._element_stiffness(trial, of_terms), of_terms.nodes)
        return tangent if rubbing is None else with_rubbing(self.problem, tangent, rubbing)

    def _element_stiffness(self, trial: _Trial, of_terms: TermStiffness) -> FloatArray:
        body, response = self.problem.body, trial.response
        elements = stiffness(body, trial.material, response, trial.pressure, of_terms.energy)
        if of_terms.elements is not None:
            elements += of_terms.elements
        return elements

    def _finish(
        self, trial: _Trial, pose: GripperPose, iterations: int, tangent: Tangent | None = None
    ) -> EquilibriumState:
        if tangent is None:
            tangent = self._assemble(replace(trial, pressure=trial.response.pressure))
        rubbing = summed_rubbing(trial.terms, trial.displacement, trial.response)
        by_pose = -tangent.free.solve(load_by_pose(self.problem, tangent, rubbing, pose))
        return EquilibriumState(
            pose,
            trial.material,
            trial.displacement,
            trial.response,
            trial.forces,
            tangent,
            by_pose,
            iterations,
            rubbing=rubbing,
        )


@dataclass(frozen=True)
class _Trial:
    material: Material
    terms: tuple[Term, ...]
    displacement: FloatArray
    response: Response
    forces: FloatArray
    pressure: FloatArray
