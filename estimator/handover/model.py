"""The calibrated phantom as another engine takes it: our own model with the causes that the engine can express.

What a cause does to the mesh, the material, the stiffness of places, the anchors and the gripper's motion is taken from
our own solution, so that an effect need not know of engines. The motion that an engine gets is the tissue's: where the
gripper slips or yields, what is left of the motion is prescribed, not the law of the slip.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.solution import mechanics_of
from estimator.diagnosis.sensitivity.readings import predicted_readings
from estimator.effects.effect import Effect, Readings
from estimator.effects.shared.sensor_steps import SensorStep, sensor_steps_of
from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.fem.assembly.body import build_body
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.terms.steady import DeadLoad, NodalSprings
from estimator.fem.terms.term import Term
from estimator.forward.meshing import mesh_experiment
from estimator.handover.found import Cause, Found
from estimator.materials import law_named
from estimator.materials.material import Material, make_material
from estimator.simulation.acting import ActingEffect
from estimator.simulation.equilibria import solve_truth
from estimator.simulation.truth import Truth, truth_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Tell = Callable[[str, int, int], None]


class Able(Protocol):
    """What an engine can express."""

    @property
    def name(self) -> str:
        """The engine's name in words."""

    @property
    def terms(self) -> tuple[type[Term], ...]:
        """Kinds of forces on the tissue that it takes."""

    @property
    def regions(self) -> bool:
        """Whether the tissue's stiffness may differ from place to place."""

    def takes(self, material: Material) -> bool:
        """Tell whether it has a law that is near the material's."""


@dataclass(frozen=True)
class Run:
    """One experiment: s load steps, n rows. Nothing that is handed over remembers: a pose is solved once.

    Attributes
    ----------
    experiment : as it was recorded
    poses : s poses of the tissue in the gripper
    reported : (n, 3) reported position of the gripper in each row, m
    of_row : (n,) load step of each row
    wrench, beads : (s, 6), (s, m, 3), as our own model has them, of the tissue alone
    recorded : as our own model has the sensors' rows
    steps : what sensors and cameras make of the observations
    """

    experiment: Experiment
    poses: tuple[GripperPose, ...]
    reported: FloatArray
    of_row: IntArray
    wrench: FloatArray
    beads: FloatArray
    recorded: Readings
    steps: tuple[SensorStep, ...]


@dataclass(frozen=True)
class HandedOver:
    """Everything that an engine's writer needs.

    Attributes
    ----------
    problem : mesh at rest, anchored and gripped nodes, beads
    material : Material
    stiffness : (e,) factor on the material's stiffness in each element
    springs : (n, 3, 3) that hold nodes to where they are at rest, N/m
    load : (n, 3) constant forces on the nodes, N
    runs : one an experiment
    causes : names of the causes that are in
    left_out : why, by the name of the cause
    """

    problem: RetractionProblem
    material: Material
    stiffness: FloatArray
    springs: FloatArray
    load: FloatArray
    runs: tuple[Run, ...]
    causes: tuple[str, ...]
    left_out: Mapping[str, str]


def hand_over(
    found: Found, experiments: Sequence[Experiment], engine: Able, grading: Grading, tell: Tell
) -> HandedOver:
    """Return what is found as an engine can take it, solved by our own model on the mesh that is handed over.

    Raises
    ------
    InputError
        The phantom cannot be meshed, or the engine has no law that is near the tissue's.
    SolverError
        The motion has no equilibrium.
    """
    tissue = found.verdict.tissue
    material = make_material(
        law_named(found.law), tissue.youngs_modulus.value, tissue.poisson_ratio.value, found.shape
    )
    if not engine.takes(material):
        raise InputError(
            f"{engine.name} has no law that is near {material.law.name}; estimate with neo_hookean"
        )
    problem = mesh_experiment(experiments[0], grading)
    if problem.rolling is not None or not problem.grips_rigidly:
        raise InputError(
            "supports that hold some directions only, boundaries that were measured, and sheets that stay flat, cannot "
            "be handed over; leave [[roller]], [[prescribed]], [grasp] directions and stays_flat out where they do not "
            "matter"
        )
    causes, left_out = _expressed(found.verdict.causes, engine, material, problem, experiments)
    if problem.regions and not engine.regions:
        # out of our own model as well, so that the two are of the same body
        problem = replace(problem, body=build_body(problem.body.mesh), regions=())
        left_out["phantom.region"] = f"{engine.name} gets one stiffness for the whole body"
    truth = truth_of(material, [ActingEffect(cause.effect, cause.values) for cause in causes])
    solutions = solve_truth(
        problem, experiments, truth, lambda done, total: tell("our own model", done, total)
    )
    changed = solutions[0].problem
    springs, load = _forces(truth, changed, experiments[0])
    runs = []
    for solution in solutions:
        mechanics, steps = mechanics_of(solution), solution.load_steps
        first, of_step = _distinct(solution.motion.position, solution.motion.rotation.as_quat(canonical=True))
        experiment = steps.experiment
        nothing = np.zeros((len(experiment.time), 6 + experiment.fiducials[0].size))
        runs.append(
            Run(
                experiment,
                tuple(map(GripperPose, solution.motion.position[first], solution.motion.rotation[first])),
                steps.position[steps.of_row],
                of_step[steps.of_row],
                mechanics.wrench[first],
                mechanics.fiducials[first],
                predicted_readings(mechanics, truth, nothing),
                _sensor_steps(truth, experiment),
            )
        )
    plain = changed.body.rest_volume
    return HandedOver(
        changed,
        truth.material(),
        np.asarray(changed.body.volume.sum(axis=1) / plain.sum(axis=1)),
        springs,
        load,
        tuple(runs),
        tuple(cause.effect.name for cause in causes),
        left_out,
    )


def _distinct(position: FloatArray, quaternion: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the first visit of each distinct pose, in their order, and for each pose (v,) which of them it is."""
    _, first, which = np.unique(
        np.hstack([position, quaternion]), axis=0, return_index=True, return_inverse=True
    )
    order = np.argsort(first)
    return first[order], np.argsort(order)[which.ravel()]


def _expressed(
    causes: Sequence[Cause],
    engine: Able,
    material: Material,
    problem: RetractionProblem,
    experiments: Sequence[Experiment],
) -> tuple[list[Cause], dict[str, str]]:
    """Return the causes that an engine and the wrapper of its observations can express, and why not the others."""
    kept, left_out = [], {}
    for cause in causes:
        why = _cannot(cause, engine, material, problem, experiments)
        if why:
            left_out[cause.effect.name] = why
        else:
            kept.append(cause)
            material = cause.effect.material(material, cause.values)
    return kept, left_out


def _cannot(
    cause: Cause,
    engine: Able,
    material: Material,
    problem: RetractionProblem,
    experiments: Sequence[Experiment],
) -> str:
    effect, values = cause.effect, cause.values
    if not engine.takes(effect.material(material, values)):
        return f"{engine.name} has no law that is near {effect.material(material, values).law.name}"
    changed = effect.problem(problem, values)
    acting = [type(term) for term in effect.terms(changed, material, experiments[0], values)]
    foreign = [kind.__name__ for kind in acting if not issubclass(kind, engine.terms)]
    if foreign:
        return f"{engine.name} gets no forces of the kind {', '.join(foreign)}"
    if not engine.regions and effect.log_modulus(changed, values) is not None:
        return f"{engine.name} gets one stiffness for the whole body"
    if sensor_steps_of(effect, experiments[0], values) is None:
        return "what it does to the readings has not been told in steps"
    return ""


def _forces(
    truth: Truth, problem: RetractionProblem, experiment: Experiment
) -> tuple[FloatArray, FloatArray]:
    """Return the springs (n, 3, 3), N/m, and the loads (n, 3), N, of all terms."""
    count = len(problem.body.mesh.points)
    springs, load = np.zeros((count, 3, 3)), np.zeros((count, 3))
    for term in truth.terms(problem, experiment):
        if isinstance(term, NodalSprings):
            springs += term.springs
        elif isinstance(term, DeadLoad):
            load += term.load
    return springs, load


def _sensor_steps(truth: Truth, experiment: Experiment) -> tuple[SensorStep, ...]:
    """Return the steps of all effects in the order in which our own model takes them."""
    pairs: list[tuple[Effect, Mapping[str, Any]]] = list(zip(truth.effects, truth.values, strict=True))
    pairs.sort(key=lambda one: not truth.rest_misread_by(one[0]))
    return tuple(
        step for effect, values in pairs for step in sensor_steps_of(effect, experiment, values) or ()
    )
