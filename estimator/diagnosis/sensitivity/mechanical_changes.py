"""How a perturbation of the hypothesis changes the solved mechanics, to first order.

At equilibrium the free nodal forces f(u, a) vanish. A perturbation that changes the nodal forces by δf at a fixed field
moves the field by −K⁻¹ δf: one back-substitution with the factor at hand, whatever the effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import Mechanics, Solution, motion_by_row
from estimator.diagnosis.sensitivity.constraint_release import changes_by_release
from estimator.diagnosis.sensitivity.linear_response import changes_by_loads, linear_response
from estimator.diagnosis.sensitivity.perturbation import MechanicalChange, Perturbation, no_change
from estimator.effects.effect import Effect
from estimator.fem.assembly.body import stress_of

FloatArray = NDArray[np.float64]


def all_mechanical_changes(
    mechanics: Sequence[Mechanics], hypothesis: Hypothesis, perturbations: Sequence[Perturbation]
) -> list[list[MechanicalChange] | None]:
    """Return the change of every experiment's mechanics under each perturbation; None where only sensors change."""
    fields = [
        k for k, p in enumerate(perturbations) if p.effect is not None and "log_modulus" in p.effect.acts_on
    ]
    rest = [k for k in range(len(perturbations)) if k not in fields]
    found: list[list[MechanicalChange] | None] = [None] * len(perturbations)
    changes = _mechanical_changes(mechanics, hypothesis, [perturbations[k] for k in rest])
    for k, change in zip(rest, changes, strict=True):
        found[k] = change
    if fields:
        log_factors = np.array(
            [_change_of_log_modulus(mechanics, hypothesis, perturbations[k]) for k in fields]
        )
        by_fields = modulus_changes(mechanics, log_factors)
        for at, k in enumerate(fields):
            found[k] = [
                replace(no_change(one.solution), wrench=wrench[at], fiducials=fiducials[at])
                for one, (wrench, fiducials) in zip(mechanics, by_fields, strict=True)
            ]
    return found


def _mechanical_changes(
    mechanics: Sequence[Mechanics], hypothesis: Hypothesis, perturbations: Sequence[Perturbation]
) -> list[list[MechanicalChange] | None]:
    found: list[list[MechanicalChange] | None] = [None] * len(perturbations)
    by_loads: list[int] = []
    releasing: dict[bool, list[int]] = {False: [], True: []}
    for k, perturbation in enumerate(perturbations):
        effect = perturbation.effect
        if effect is not None and not (effect.acts_on_tissue or perturbation.to.rest_misread_by(effect)):
            continue
        if effect is None and not any(present.acts_on_tissue for present in hypothesis.effects):
            found[k] = [_by_material(one, hypothesis, perturbation.to) for one in mechanics]
        elif effect is not None and _releases_nodes(effect, mechanics[0].solution, perturbation.to):
            releasing[perturbation.to.rate_dependent].append(k)
        else:
            by_loads.append(k)
    for released in filter(None, releasing.values()):
        solutions, to = [one.solution for one in mechanics], [perturbations[k].to for k in released]
        for k, change in zip(released, changes_by_release(solutions, hypothesis, to), strict=True):
            found[k] = change
    changes = changes_by_loads(mechanics, hypothesis, [perturbations[k] for k in by_loads])
    for k, change in zip(by_loads, changes, strict=True):
        found[k] = change
    return [
        _with_motion(mechanics, hypothesis, perturbation, change)
        for perturbation, change in zip(perturbations, found, strict=True)
    ]


def _releases_nodes(effect: Effect, solution: Solution, to: Hypothesis) -> bool:
    """Tell whether a perturbation sets nodes free that the solved problem holds: its factor has no rows for them."""
    return not effect.keeps_pattern and not np.array_equal(
        to.problem(solution.baseline).held, solution.problem.held
    )


def _with_motion(
    mechanics: Sequence[Mechanics],
    hypothesis: Hypothesis,
    perturbation: Perturbation,
    changes: list[MechanicalChange] | None,
) -> list[MechanicalChange] | None:
    effect = perturbation.effect
    acting = (
        "motion" in effect.acts_on
        if effect is not None
        else any(one.acts_on_tissue for one in hypothesis.effects)
    )
    if changes is None or not acting:
        return changes
    return [_moved(one, perturbation.to, c) for one, c in zip(mechanics, changes, strict=True)]


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
        solution = one.solution
        problem = solution.problem
        body = problem.body
        nodes = body.mesh.cells.ravel()
        count = len(body.mesh.points)
        gather = csr_array((np.ones(len(nodes)), (nodes, np.arange(len(nodes)))), shape=(count, len(nodes)))
        answers = {}
        for state in solution.distinct_states:
            stress = stress_of(state.response.F, state.response.slope) * body.volume[:, :, None, None]
            shares = np.einsum("eqij,eqkj->eqki", stress, body.gradient, optimize=True)
            shares = shares.reshape(*shares.shape[:2], -1)
            of_elements = np.einsum("peq,eqx->epx", log_factors, shares, optimize=True)
            blocks = of_elements.reshape(*of_elements.shape[:2], -1, 3).transpose(0, 2, 1, 3)
            loads = (gather @ blocks.reshape(len(nodes), -1)).reshape(count, -1, 3).transpose(0, 2, 1)
            answers[id(state)] = linear_response(problem, state, loads.reshape(3 * count, -1))
        wrenches, fiducials = zip(*(answers[id(state)] for state in solution.states), strict=True)
        rows = solution.load_steps.of_row
        by_row = [solution.filled(np.array(known))[rows] for known in (wrenches, fiducials)]
        result.append((np.moveaxis(by_row[0], 2, 0), np.moveaxis(by_row[1], 3, 0)))
    return result


def _change_of_log_modulus(
    mechanics: Sequence[Mechanics], hypothesis: Hypothesis, perturbation: Perturbation
) -> FloatArray:
    """Return the change (e, q) of the field that an effect lays over the tissue."""
    problem, effect = mechanics[0].solution.problem, perturbation.effect
    zero = np.zeros(problem.body.volume.shape)
    fields = [zero, zero]
    for n, one in enumerate((hypothesis, perturbation.to)):
        if effect in one.effects:
            field = effect.log_modulus(problem, one.values[one.effects.index(effect)])
            fields[n] = zero if field is None else field
    return fields[1] - fields[0]


def _by_material(one: Mechanics, hypothesis: Hypothesis, to: Hypothesis) -> MechanicalChange:
    """Return what a change of E and ν does to the baseline's tissue."""
    rows = one.solution.load_steps.of_row
    wrench, fiducials = np.zeros_like(one.wrench), np.zeros_like(one.fiducials)
    for name in ("youngs_modulus", "poisson_ratio"):
        change = getattr(to, name) - getattr(hypothesis, name)
        wrench += change * np.array([o.wrench_by[name] for o in one.observations])
        fiducials += change * np.array([o.fiducials_by[name] for o in one.observations])
    return replace(no_change(one.solution), wrench=wrench[rows], fiducials=fiducials[rows])


def _moved(one: Mechanics, to: Hypothesis, change: MechanicalChange) -> MechanicalChange:
    """Add what a changed motion of the gripper does."""
    solution = one.solution
    rows = solution.load_steps.of_row
    motion = to.motion(motion_by_row(solution, to))
    turn = (motion.rotation * solution.motion.rotation[rows].inv()).as_rotvec()
    shift = np.hstack([motion.position - solution.motion.position[rows], turn])
    wrench = np.array([o.wrench_by_pose for o in one.observations])
    fiducials = np.array([o.fiducials_by_pose for o in one.observations])
    return MechanicalChange(
        change.wrench + np.einsum("nij,nj->ni", wrench[rows], shift),
        change.fiducials + np.einsum("nmij,nj->nmi", fiducials[rows], shift),
        change.motion + shift,
    )
