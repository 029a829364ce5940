"""The estimate while a retraction runs: renewed after each of its steps.

    following = follow_from(experiment_at_rest, FitSettings())
    following = advance(following, rows)          # what the sensors gave while the gripper stood
    following.estimate
    following = renewed(following)                # once that is shown

Every step of the motion is solved once, from the one before. Where the parameters have moved on since, its prediction
is extrapolated to them, and after each step the one that is farthest from them is solved anew, so that a step costs
two solved states however many there are, and only one before its estimate is there. The discretisation error is left to
the estimation once the retraction is over.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.fem.equilibrium.settling import settled
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.fit.linearised_fit import LinearisedFit, linearised_fit, whitenings_of
from estimator.fit.losses import LINEAR
from estimator.fit.measurements import StateMean, mean_of_rows
from estimator.fit.nuisances import floating
from estimator.fit.result import ParameterEstimate, interval
from estimator.fit.search import Values, at_values, internal_change, moved, search, values_at
from estimator.fit.settings import FitSettings
from estimator.forward.meshing import mesh_experiment
from estimator.inference.channels import channel_variance, side_by_side
from estimator.inference.extrapolation import extrapolated
from estimator.inference.gauss_newton import NewtonStep, Rule, newton_step
from estimator.inference.material_parameters import law_parameters
from estimator.inference.whitening import Whitening

FloatArray = NDArray[np.float64]

# Internal variables other than ln E may be this far off before a state is worth solving anew.
_NEAR = 0.05
_EVALUATIONS, _STEADY = 20, 1e-3
# The gripper has moved once it is this many deviations of its reported position from where it began.
_MOVED = 20.0
# The tangent of the last correction is good enough for derivatives.
_NEWTON = NewtonSettings(tolerance=1e-7, tangent_reuse=1e-3)


@dataclass(frozen=True, eq=False)
class Rows:
    """What was measured while the gripper stood: n rows, as in :class:`~estimator.experiment.Experiment`.

    Attributes
    ----------
    position, quaternion_wxyz : (n, 3) in m and (n, 4), tissue frame
    wrench : (n, 6), N and N·m
    fiducials : (n, m, 3), m
    """

    position: FloatArray
    quaternion_wxyz: FloatArray
    wrench: FloatArray
    fiducials: FloatArray


@dataclass(frozen=True, eq=False)
class SolvedStep:
    """One step: what was measured, the whitening of that, and its prediction for some parameter values."""

    mean: StateMean
    whitening: Whitening
    pose: GripperPose
    values: Values
    observation: Observation
    displacement: FloatArray
    pressure: FloatArray


@dataclass(frozen=True, slots=True)
class OnlineEstimate:
    """The parameters after a step.

    Attributes
    ----------
    step : number of the step, from 0
    parameters : all of the material by name; the intervals know of noise and nuisances, not of the discretisation
    noise_ratio : root mean square residual of the steps' means in units of their stated noise
    seconds : wall time that the step took
    """

    step: int
    parameters: dict[str, ParameterEstimate]
    noise_ratio: float
    seconds: float


@dataclass(frozen=True, eq=False)
class Following:
    """All that is carried from one step to the next; a value.

    Attributes
    ----------
    experiment : the phantom, how it is held and its sensors; its rows are not looked at
    settings : of the fit
    solver : keeps factorisations
    steps : so far
    reached : the last solved state
    values : of all parameters, as they are now
    estimate : after the last step; None until the gripper has moved
    """

    experiment: Experiment
    settings: FitSettings
    solver: EquilibriumSolver
    steps: tuple[SolvedStep, ...]
    reached: EquilibriumState
    values: Values
    estimate: OnlineEstimate | None


def follow_from(
    experiment: Experiment,
    settings: FitSettings | None = None,
    mesh: Callable[[Experiment], RetractionProblem] = mesh_experiment,
) -> Following:
    """Return what a retraction starts from: the mesh, and the tissue at rest.

    Raises
    ------
    InputError
        The phantom cannot be meshed, or the settings ask for what only a whole estimation does.
    """
    settings = settings or FitSettings()
    if settings.objective != "likelihood" or settings.loss != LINEAR or settings.intervals != "linear":
        raise InputError(
            "a running retraction is followed by maximum likelihood with the linear loss and linear intervals; "
            "leave the other choices to the estimation afterwards"
        )
    if experiment.zeroed_under_load:
        raise InputError(
            "a running retraction that begins under load is followed by absolute forces; write force_zero = "
            '"no_load" in [sensor] if they are, or leave it to the estimation afterwards'
        )
    solver = EquilibriumSolver(mesh(experiment), _NEWTON)
    rest = settled(solver, settings.material(settings.start))
    return Following(experiment, settings, solver, (), rest, settings.start, None)


def advance(following: Following, rows: Rows) -> Following:
    """Return the following after one more step.

    Raises
    ------
    SolverError
        The motion to the step has no equilibrium.
    FitError
        The measurements do not determine the parameters.
    """
    started = time.perf_counter()
    solver, settings = following.solver, following.settings
    pose = GripperPose(
        rows.position.mean(axis=0), Rotation.from_quat(rows.quaternion_wxyz, scalar_first=True).mean()
    )
    reached = solver.solve(pose, settings.material(following.values), following.reached)
    mean = _mean(following.experiment, rows, len(following.steps))
    steps = (*following.steps, _solved(solver, mean, reached, following.values))
    if not _has_moved(following.experiment, steps):
        return replace(following, steps=steps, reached=reached)
    values, last = _fit(steps, settings, following.values)
    estimate = _estimate(steps, settings, values, last, time.perf_counter() - started)
    return replace(following, steps=steps, reached=reached, values=values, estimate=estimate)


def renewed(following: Following) -> Following:
    """Return the following with the step that was solved farthest from the present values solved anew, if that is far.

    The estimate stays; the next one is the better for it.

    Raises
    ------
    SolverError
        The step has no equilibrium at these values.
    """
    others = law_parameters(following.settings.law)[1:]
    distances = [
        float(np.abs(internal_change(others, step.values, following.values)).max())
        for step in following.steps
    ]
    if max(distances, default=0.0) < _NEAR:
        return following
    worst = int(np.argmax(distances))
    steps = list(following.steps)
    steps[worst] = _resolved(following.solver, following.settings, steps[worst], following.values)
    return replace(following, steps=tuple(steps))


def follow(experiment: Experiment, settings: FitSettings | None = None) -> Iterator[OnlineEstimate]:
    """Go through a recorded experiment as if it ran, and yield the estimate after each of its steps.

    Raises
    ------
    InputError, SolverError, FitError
        As :func:`follow_from` and :func:`advance` do.
    """
    following = follow_from(experiment, settings)
    for rows in standing_rows(experiment):
        following = advance(renewed(following), rows)
        if following.estimate is not None:
            yield following.estimate


def standing_rows(experiment: Experiment) -> Iterator[Rows]:
    """Yield the rows of each stay of the gripper, in their order."""
    numbers = range(len(experiment.time))
    for (_, phase), group in groupby(numbers, key=lambda n: (experiment.step[n], experiment.phase[n])):
        of_stay = list(group)
        if phase in ("hold", "return_hold"):
            yield Rows(
                experiment.position[of_stay],
                experiment.quaternion_wxyz[of_stay],
                experiment.wrench[of_stay],
                experiment.fiducials[of_stay],
            )


def _mean(experiment: Experiment, rows: Rows, number: int) -> StateMean:
    values = side_by_side(rows.wrench, rows.fiducials)
    weights = np.isfinite(values).astype(np.float64)
    return mean_of_rows(0, number, values, weights, channel_variance(experiment), experiment.sensor.pose_std)


def _solved(
    solver: EquilibriumSolver, mean: StateMean, state: EquilibriumState, values: Values
) -> SolvedStep:
    seen = observe(solver.problem, state)
    (whitening,) = whitenings_of([mean], [{mean.state: seen}]).values()
    return SolvedStep(
        mean, whitening, state.pose, dict(values), seen, state.displacement, state.response.pressure
    )


def _resolved(
    solver: EquilibriumSolver, settings: FitSettings, step: SolvedStep, values: Values
) -> SolvedStep:
    """Solve a step for other values, from its field extrapolated to them."""
    guess = step.displacement.copy().reshape(-1)
    others = at_values(law_parameters(settings.law)[1:], step.values)
    for parameter, change in zip(others, internal_change(others, step.values, values), strict=True):
        by_internal = parameter.slope * step.observation.field_by[parameter.name]
        guess[solver.problem.pattern.free] += change * by_internal
    pressure = step.pressure * values["youngs_modulus"] / step.values["youngs_modulus"]
    field = guess.reshape(step.displacement.shape)
    state = solver.refine(step.pose, settings.material(values), field, pressure)
    return _solved(solver, step.mean, state, values)


def _has_moved(experiment: Experiment, steps: tuple[SolvedStep, ...]) -> bool:
    origin = np.asarray(experiment.grasp.centre)
    farthest = max(float(np.linalg.norm(step.pose.position - origin)) for step in steps)
    return farthest > _MOVED * experiment.sensor.position_std


def _fit(steps: tuple[SolvedStep, ...], settings: FitSettings, start: Values) -> tuple[Values, NewtonStep]:
    """Return the best values by the extrapolated predictions, and the last step to them."""
    parameters, nuisances = law_parameters(settings.law), floating(settings.nuisances)
    means = [step.mean for step in steps]
    whitenings = {(0, step.mean.state): step.whitening for step in steps}

    def linearised(values: Values) -> LinearisedFit:
        seen = {s.mean.state: extrapolated(s.observation, parameters, s.values, values) for s in steps}
        return linearised_fit(means, [seen], at_values(settings.free, values), whitenings, nuisances)

    rule = Rule(worthwhile=0.0, tolerance=_STEADY, kept=0.0)
    best = search(linearised, start, rule, _EVALUATIONS).points[-1]
    last = newton_step(best)
    return moved(settings.free, values_at(best, start), last.step), last


def _estimate(
    steps: tuple[SolvedStep, ...], settings: FitSettings, values: Values, last: NewtonStep, seconds: float
) -> OnlineEstimate:
    count = sum(int(np.count_nonzero(step.mean.count)) for step in steps)
    ratio = float(np.sqrt(last.chi2_after / max(count - len(settings.free), 1)))
    deviations = max(1.0, ratio) * np.sqrt(np.diag(last.covariance))
    free = {
        p.name: interval(p, float(deviation))
        for p, deviation in zip(at_values(settings.free, values), deviations, strict=True)
    }
    fixed = {name: ParameterEstimate(value, 0.0, (value, value)) for name, value in settings.fixed.items()}
    everything = {**free, **fixed}
    ordered = {p.name: everything[p.name] for p in law_parameters(settings.law)}
    return OnlineEstimate(len(steps) - 1, ordered, ratio, seconds)
