"""How a perturbation of the hypothesis changes the solved mechanics, to first order.

At equilibrium the free nodal forces f(u, a) vanish. A perturbation that changes the nodal forces by δf at a fixed field
moves the field by −K⁻¹ δf: one back-substitution with the factor at hand, whatever the effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from estimator.diagnosis.chain import TermChain
from estimator.diagnosis.hypothesis import Hypothesis
from estimator.diagnosis.passage import Mechanics, Passage, reported_motion
from estimator.effects.effect import Effect
from estimator.fem.body import nodal_forces, respond, stress_of
from estimator.fem.equilibrium import EquilibriumSolver, EquilibriumState, rigid_modes
from estimator.fem.observation import interpolate
from estimator.fem.problem import RetractionProblem

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Perturbation:
    """A hypothesis a small step away from another.

    Attributes
    ----------
    name : what is perturbed
    to : the perturbed hypothesis
    effect : the effect whose parameter it is; None for E and ν
    step : size of the perturbation, internal units
    """

    name: str
    to: Hypothesis
    effect: Effect | None
    step: float


@dataclass(frozen=True)
class MechanicalChange:
    """The change of one experiment's mechanics, row by row.

    Attributes
    ----------
    wrench : (n, 6) N, N·m
    fiducials : (n, m, 3) m
    motion : (n, 6) translation (m) and rotation vector (rad) of the gripper
    """

    wrench: FloatArray
    fiducials: FloatArray
    motion: FloatArray


def all_mechanical_changes(
    mechanics: Sequence[Mechanics], hypothesis: Hypothesis, perturbations: Sequence[Perturbation]
) -> list[list[MechanicalChange] | None]:
    """Return the change of every experiment's mechanics under each perturbation; None where only sensors change."""
    fields = [
        k for k, p in enumerate(perturbations) if p.effect is not None and _overrides(p.effect, "log_modulus")
    ]
    found: list[list[MechanicalChange] | None] = [
        None if k in fields else _mechanical_changes(mechanics, hypothesis, perturbation)
        for k, perturbation in enumerate(perturbations)
    ]
    if fields:
        log_factors = np.array(
            [_change_of_log_modulus(mechanics, hypothesis, perturbations[k]) for k in fields]
        )
        changes = modulus_changes(mechanics, log_factors)
        for at, k in enumerate(fields):
            found[k] = [
                replace(_no_change(one.passage), wrench=wrench[at], fiducials=fiducials[at])
                for one, (wrench, fiducials) in zip(mechanics, changes, strict=True)
            ]
    return found


def _mechanical_changes(
    mechanics: Sequence[Mechanics], hypothesis: Hypothesis, perturbation: Perturbation
) -> list[MechanicalChange] | None:
    effect = perturbation.effect
    if effect is not None and not acts_on_tissue(effect):
        return None
    if effect is None and not any(acts_on_tissue(present) for present in hypothesis.effects):
        return [_by_material(one, hypothesis, perturbation.to) for one in mechanics]
    if effect is not None and not effect.keeps_pattern:
        changes = _by_newton_steps(mechanics, perturbation.to)
    else:
        changes = _by_loads(mechanics, hypothesis, perturbation)
    if _overrides(effect, "motion") if effect is not None else hypothesis.effects:
        changes = [_moved(one, perturbation.to, c) for one, c in zip(mechanics, changes, strict=True)]
    return changes


def acts_on_tissue(effect: Effect) -> bool:
    """Tell whether an effect changes the mechanics, not only what the sensors make of them."""
    return any(_overrides(effect, hook) for hook in ("material", "problem", "log_modulus", "terms", "motion"))


def _overrides(effect: Effect, hook: str) -> bool:
    return getattr(type(effect), hook) is not getattr(Effect, hook)


@dataclass(frozen=True)
class _Station:
    """A time at which the terms are evaluated: a visit, or a row of it where the tissue changes at rest."""

    state: EquilibriumState
    elapsed_s: float
    rows: slice


def _stations(passage: Passage, rate_dependent: bool) -> list[_Station]:
    visits = passage.visits
    if rate_dependent:
        times = visits.experiment.time
        starts = np.arange(len(times))
    else:
        times, starts = visits.time, np.searchsorted(visits.of_row, np.arange(len(visits)))
    ends = [*starts[1:], len(visits.of_row)]
    elapsed = np.diff(times, prepend=times[0])
    return [
        _Station(passage.states[visits.of_row[start]], float(seconds), slice(start, end))
        for start, end, seconds in zip(starts, ends, elapsed, strict=True)
    ]


def modulus_changes(
    mechanics: Sequence[Mechanics], log_factors: FloatArray
) -> list[tuple[FloatArray, FloatArray]]:
    """Return what many small fields of stiffness would change, all at once.

    Parameters
    ----------
    mechanics : of each experiment
    log_factors : (p, e, q) change of the modulus' logarithm at the integration points

    Returns
    -------
    changes : for each experiment the change of the wrench (p, n, 6) and of the fiducials (p, n, m, 3)
    """
    result = []
    for one in mechanics:
        passage = one.passage
        problem = passage.problem
        body = problem.body
        nodes = body.mesh.cells.ravel()
        count = len(body.mesh.points)
        gather = csr_array((np.ones(len(nodes)), (nodes, np.arange(len(nodes)))), shape=(count, len(nodes)))
        wrenches, fiducials = [], []
        for state in passage.states:
            stress = stress_of(state.response.F, state.response.slope) * body.volume[:, :, None, None]
            shares = np.einsum("eqij,eqkj->eqki", stress, body.gradient, optimize=True)
            shares = shares.reshape(*shares.shape[:2], -1)
            of_elements = np.einsum("peq,eqx->epx", log_factors, shares, optimize=True)
            blocks = of_elements.reshape(*of_elements.shape[:2], -1, 3).transpose(0, 2, 1, 3)
            loads = (gather @ blocks.reshape(len(nodes), -1)).reshape(count, -1, 3).transpose(0, 2, 1)
            wrench, moved = _linear_answers(problem, state, loads.reshape(3 * count, -1))
            wrenches.append(wrench)
            fiducials.append(moved)
        rows = passage.visits.of_row
        result.append(
            (np.moveaxis(np.array(wrenches), 2, 0)[:, rows], np.moveaxis(np.array(fiducials), 3, 0)[:, rows])
        )
    return result


def _by_loads(
    mechanics: Sequence[Mechanics], hypothesis: Hypothesis, perturbation: Perturbation
) -> list[MechanicalChange]:
    effect, to = perturbation.effect, perturbation.to
    passages = [one.passage for one in mechanics]
    material = to.material()
    new_material = effect is None or _overrides(effect, "material")
    new_problem = effect is not None and _overrides(effect, "problem")
    problem = to.problem(passages[0].baseline) if new_problem else passages[0].problem
    terms_matter = bool(hypothesis.effects) or (effect is not None and _overrides(effect, "terms"))
    before, after = TermChain(hypothesis), TermChain(to)
    result = []
    for passage in passages:
        change = _no_change(passage)
        if not (new_material or new_problem or terms_matter):
            result.append(change)
            continue
        before.begin(passage.problem, passage.visits.experiment)
        after.begin(problem, passage.visits.experiment)
        for station in _stations(passage, to.rate_dependent):
            state = station.state
            displacement, response = state.displacement, state.response
            load = np.zeros_like(displacement)
            if new_problem:
                gripped = problem.gripped
                displacement = displacement.copy()
                displacement[gripped] = (
                    problem.gripped_positions(state.pose) - problem.body.mesh.points[gripped]
                )
            if new_problem or new_material:
                response = respond(problem.body, material, displacement)
                load += nodal_forces(problem.body, response, response.slope)
                load -= nodal_forces(passage.problem.body, state.response, state.response.slope)
            if terms_matter:
                load += after.forces(station.elapsed_s, displacement, response)
                load -= before.forces(station.elapsed_s, state.displacement, state.response)
            wrench, fiducials = _answer(passage.problem, problem, state, displacement, load)
            change.wrench[station.rows] = wrench
            change.fiducials[station.rows] = fiducials
        result.append(change)
    return result


def _answer(
    problem: RetractionProblem,
    changed: RetractionProblem,
    state: EquilibriumState,
    displacement: FloatArray,
    load: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the change of wrench and fiducials once the nodal forces have changed by ``load`` (n, 3)."""
    wrenches, moved = _linear_answers(problem, state, load.reshape(-1, 1))
    wrench, fiducials = wrenches[:, 0], moved[:, :, 0]
    if changed is not problem:
        reaction = state.forces[problem.gripped].reshape(-1)
        wrench -= (rigid_modes(changed, state.pose) - rigid_modes(problem, state.pose)).T @ reaction
        fiducials += changed.fiducial_positions(displacement, state.pose)
        fiducials -= problem.fiducial_positions(state.displacement, state.pose)
    return wrench, fiducials


def _linear_answers(
    problem: RetractionProblem, state: EquilibriumState, loads: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the changes of wrench (6, k) and fiducials (m, 3, k) by changes of the nodal forces (3n, k)."""
    free, gripped = problem.pattern.free, problem.gripped
    motion = np.zeros(loads.shape)
    motion[free] = -state.tangent.free.solve(loads[free])
    held = loads.reshape(-1, 3, loads.shape[1])[gripped].reshape(-1, loads.shape[1])
    held = held + state.tangent.gripped_free @ motion[free]
    return -rigid_modes(problem, state.pose).T @ held, interpolate(problem, motion)


def _change_of_log_modulus(
    mechanics: Sequence[Mechanics], hypothesis: Hypothesis, perturbation: Perturbation
) -> FloatArray:
    """Return the change (e, q) of the field that an effect lays over the tissue."""
    problem, effect = mechanics[0].passage.problem, perturbation.effect
    zero = np.zeros(problem.body.volume.shape)
    fields = [zero, zero]
    for n, one in enumerate((hypothesis, perturbation.to)):
        if effect in one.effects:
            field = effect.log_modulus(problem, one.values[one.effects.index(effect)])
            fields[n] = zero if field is None else field
    return fields[1] - fields[0]


def _by_newton_steps(mechanics: Sequence[Mechanics], to: Hypothesis) -> list[MechanicalChange]:
    """Take one Newton step of the changed problem from every solved state."""
    passages = [one.passage for one in mechanics]
    changed = to.problem(passages[0].baseline)
    solver, material = EquilibriumSolver(changed), to.material()
    chain = TermChain(to)
    result = []
    for passage, one in zip(passages, mechanics, strict=True):
        change = _no_change(passage)
        chain.begin(changed, passage.visits.experiment)
        for station in _stations(passage, to.rate_dependent):
            state = station.state
            terms = chain.at(station.elapsed_s)
            displacement, forces = solver.newton_step(
                state.pose, material, state.displacement, state.response.pressure, terms
            )
            chain.pass_by(state.displacement, state.response)
            modes = rigid_modes(changed, state.pose)
            visit = int(passage.visits.of_row[station.rows.start])
            known = one.observations[visit]
            wrench = -modes.T @ forces[changed.gripped].reshape(-1)
            change.wrench[station.rows] = wrench - known.wrench
            change.fiducials[station.rows] = (
                changed.fiducial_positions(displacement, state.pose) - known.fiducials
            )
        result.append(change)
    return result


def _by_material(one: Mechanics, hypothesis: Hypothesis, to: Hypothesis) -> MechanicalChange:
    """Return what a change of E and ν does to the baseline's tissue."""
    rows = one.passage.visits.of_row
    wrench, fiducials = np.zeros_like(one.wrench), np.zeros_like(one.fiducials)
    for name in ("youngs_modulus", "poisson_ratio"):
        change = getattr(to, name) - getattr(hypothesis, name)
        wrench += change * np.array([o.wrench_by[name] for o in one.observations])
        fiducials += change * np.array([o.fiducials_by[name] for o in one.observations])
    return replace(_no_change(one.passage), wrench=wrench[rows], fiducials=fiducials[rows])


def _moved(one: Mechanics, to: Hypothesis, change: MechanicalChange) -> MechanicalChange:
    """Add what a changed motion of the gripper does."""
    passage = one.passage
    motion = to.motion(reported_motion(passage.visits, to, passage.unit_wrench))
    turn = (motion.rotation * passage.motion.rotation.inv()).as_rotvec()
    shift = np.hstack([motion.position - passage.motion.position, turn])
    rows = passage.visits.of_row
    wrench = np.array([o.wrench_by_pose @ s for o, s in zip(one.observations, shift, strict=True)])
    fiducials = np.array([o.fiducials_by_pose @ s for o, s in zip(one.observations, shift, strict=True)])
    return MechanicalChange(
        change.wrench + wrench[rows], change.fiducials + fiducials[rows], change.motion + shift[rows]
    )


def _no_change(passage: Passage) -> MechanicalChange:
    rows, beads = len(passage.visits.of_row), len(passage.problem.fiducials_rest)
    return MechanicalChange(np.zeros((rows, 6)), np.zeros((rows, beads, 3)), np.zeros((rows, 6)))
