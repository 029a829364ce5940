"""From the last linearisation to the values, intervals and residuals that people read."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.equilibrium.observation import Observation
from estimator.fit.budget.assembly import Body, all_components
from estimator.fit.budget.budget import Budget
from estimator.fit.budget.changes import changes_of_rows
from estimator.fit.budget.evaluation import budget_of
from estimator.fit.budget.gains import FittedCase
from estimator.fit.budget.systematic import Stated
from estimator.fit.identifiability import CONFOUNDERS, OFF, absorptions, identifiability
from estimator.fit.linearisation import Linearisation
from estimator.fit.linearised_fit import LinearisedFit, whitened_rows
from estimator.fit.measurements import StateMean, row_deviation
from estimator.fit.nuisances import FORCE_GAIN, GAIN_STD, REST_POSITIONS, TARE, FloatingNuisance, floating
from estimator.fit.profile import Profile
from estimator.fit.result import Estimate, ExperimentFit, Floated, ParameterEstimate, Rmse, interval
from estimator.fit.search import Iterate, at_values, determined_step, internal_change
from estimator.fit.settings import FitSettings
from estimator.forward.model import ForwardModel
from estimator.inference.channels import (
    channel_variance,
    channels_by,
    measured_rows,
    predicted_channels,
    side_by_side,
)
from estimator.inference.free_parameter import FreeParameter, prior_information
from estimator.inference.material_parameters import law_parameters
from estimator.inference.normal import Z95
from estimator.inference.prior_share import prior_shares

FloatArray = NDArray[np.float64]

_ELASTIC = ("youngs_modulus", "poisson_ratio")
# A measurement with less weight than this counts as rejected by the loss.
_REJECTED = 0.5


@dataclass(frozen=True, eq=False)
class FitOutcome:
    """A finished fit.

    Attributes
    ----------
    problem : the least-squares problem of all states, corrected for the discretisation error
    linearised_at : parameter values at which it was solved last
    values : final parameter values by name
    weights : for each experiment those of its rows' channels, (n, 6 + 3m)
    change : prediction on the finer mesh less that on the model's, for each (experiment, state), (6 + 3m,)
    discretisation : (p,) what correcting for that moved the internal variables by
    bias_std : (p,) standard deviation of the bias that the discretisation leaves, in internal variables
    finer_solves : states solved on the finer mesh
    """

    experiments: tuple[Experiment, ...]
    model: ForwardModel
    settings: FitSettings
    problem: Linearisation
    linearised_at: dict[str, float]
    values: dict[str, float]
    iterates: tuple[Iterate, ...]
    weights: Sequence[FloatArray]
    change: Mapping[tuple[int, int], FloatArray]
    discretisation: FloatArray
    bias_std: FloatArray
    finer_solves: int


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """How sure a finished fit is.

    Attributes
    ----------
    noise_ratio : root mean square residual in units of the stated noise
    inflation : by how much that widens intervals, at least one
    covariance : (p, p) of the internal variables, widened, without the bias of the discretisation
    bias_std : (p,) of that bias
    """

    noise_ratio: float
    inflation: float
    covariance: FloatArray
    bias_std: FloatArray

    @property
    def std(self) -> FloatArray:
        """Standard deviations (p,) of the internal variables, all told."""
        return np.asarray(np.sqrt(np.diag(self.covariance) + self.bias_std**2))


def uncertainty(outcome: FitOutcome) -> Uncertainty:
    """Return how sure a finished fit is, by linearisation."""
    settings, problem = outcome.settings, outcome.problem
    step = determined_step(problem.likelihood(outcome.linearised_at))
    moved = internal_change(settings.free, outcome.linearised_at, outcome.values)
    chi2 = step.chi2 - float(2 * step.gradient @ moved - moved @ step.information @ moved)
    ratio = problem.noise_ratio(outcome.experiments, outcome.weights, outcome.linearised_at, chi2)
    inflation = max(1.0, ratio)
    covariance = inflation**2 * problem.covariance(outcome.linearised_at)
    priors = prior_information(at_values(settings.free, outcome.linearised_at))
    if priors.any():
        # A prior is no less sure where the measurements scatter more than stated.
        information = (step.information - priors) / inflation**2 + priors / settings.prior_weight**2
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return Uncertainty(ratio, inflation, covariance, outcome.bias_std)


def summarise(
    outcome: FitOutcome, found: Uncertainty, profiles: Sequence[Profile], started: float
) -> Estimate:
    """Return the estimate that a finished fit amounts to; ``started`` by the performance counter."""
    settings, values, problem = outcome.settings, outcome.values, outcome.problem
    # Profiles may have left it at another point.
    last = problem.likelihood(outcome.linearised_at)
    fits = tuple(_fit_of(outcome, number) for number in range(len(outcome.experiments)))
    stacked = np.concatenate(
        [measured_rows(f.experiment) - side_by_side(f.wrench, f.fiducials) for f in fits]
    )
    intervals = {
        parameter.name: interval(parameter, float(std))
        for parameter, std in zip(at_values(settings.free, values), found.std, strict=True)
    }
    for one, parameter, bias in zip(profiles, settings.free, found.bias_std, strict=False):
        intervals[one.name] = _profiled(parameter, one, intervals[one.name], float(bias))
    parameters = {
        p.name: intervals.get(
            p.name, ParameterEstimate(values[p.name], 0.0, (values[p.name], values[p.name]))
        )
        for p in law_parameters(settings.law)
    }
    names = [parameter.name for parameter in settings.free]
    shape = {name: value for name, value in parameters.items() if name not in _ELASTIC}
    step = determined_step(last)
    absorbed = absorptions(last, _confounders(outcome, last))
    priors = prior_information(last.free_parameters)
    return Estimate(
        youngs_modulus=parameters["youngs_modulus"],
        poisson_ratio=parameters["poisson_ratio"],
        correlation=_correlation(found, names),
        rmse=Rmse(_rms(stacked[:, :3]), _rms(stacked[:, 3:6]), _rms(stacked[:, 6:])),
        noise_ratio=found.noise_ratio,
        inflation=found.inflation,
        iterates=outcome.iterates,
        forward_solves=outcome.model.solved_states + outcome.finer_solves,
        seconds=time.perf_counter() - started,
        mesh=outcome.model.problem.body.mesh,
        discretisation_force=max(float(np.abs(c[:3]).max()) for c in outcome.change.values()),
        fits=fits,
        law=settings.law.name,
        shape=shape,
        fixed=tuple(settings.fixed),
        at_bound=tuple(p.name for p in settings.free if not p.lower < values[p.name] < p.upper),
        objective=settings.objective,
        prior_shares=dict(zip(names, prior_shares(step.information - priors, priors).tolist(), strict=True)),
        identifiability=identifiability(
            replace(settings, prior_weight=1.0).free, step.information - priors, priors, absorbed
        ),
        absorptions=absorbed,
        floated=_floated(outcome, last, last.nuisances_after(step.step)),
        profiles=tuple(profiles),
    )


def budget(
    outcome: FitOutcome, found: Uncertainty, stated: Stated, tell: Callable[[int, int], None]
) -> Budget:
    """Return the uncertainty budget of a finished fit.

    Parameters
    ----------
    stated : what is known of errors beyond what the experiments state
    tell : called with how many states of a body of another geometry are solved, and how many there are

    Raises
    ------
    InputError
        A size is stated of what the fit estimates.
    """
    settings, problem = outcome.settings, outcome.problem
    problem.likelihood(outcome.linearised_at)  # profiles may have left it at another point
    case = FittedCase(
        outcome.experiments,
        outcome.model.schedules,
        problem.means,
        problem.predictions,
        at_values(replace(settings, prior_weight=1.0).free, outcome.linearised_at),
        settings.nuisances,
        found.inflation,
        outcome.model.problem.fiducials_rest if settings.objective == "paper" else None,
    )
    body = Body(outcome.model.problem, settings.material(outcome.linearised_at))
    components, left_out = all_components(case, body, found.bias_std, stated, tell)
    return budget_of(at_values(settings.free, outcome.values), components, left_out)


def _correlation(found: Uncertainty, names: Sequence[str]) -> float:
    if not set(_ELASTIC) <= set(names):
        return 0.0
    covariance = found.covariance + np.outer(found.bias_std, found.bias_std)
    one, other = (names.index(name) for name in _ELASTIC)
    return float(covariance[one, other] / np.sqrt(covariance[one, one] * covariance[other, other]))


def _confounders(outcome: FitOutcome, last: LinearisedFit) -> FloatArray:
    """Return the whitened change (r, k) by every confounder."""
    problem = outcome.problem
    changes = [
        changes_of_rows(one, OFF, outcome.experiments, outcome.model.schedules, problem.predictions)
        for one in CONFOUNDERS
    ]

    def columns(mean: StateMean, observation: Observation) -> FloatArray:
        del observation
        return np.hstack([change[mean.experiment, mean.state] for change in changes])

    return last.whitened(whitened_rows(problem.means, problem.predictions, problem.whitenings, columns))


def _floated(outcome: FitOutcome, last: LinearisedFit, nuisances: FloatArray) -> Floated:
    """Return what the nuisances (k,) at the linearised optimum amount to."""
    count = len(outcome.experiments)
    deviation = np.sqrt(channel_variance(outcome.experiments[0]))
    sizes = {TARE: 6 * count, REST_POSITIONS: len(deviation) - 6, FORCE_GAIN: 1}
    found: dict[FloatingNuisance, FloatArray] = {n: np.zeros(size) for n, size in sizes.items()}
    start = 0
    for nuisance in floating(outcome.settings.nuisances):
        found[nuisance] = nuisances[start : start + sizes[nuisance]]
        start += sizes[nuisance]
    tares = [
        np.sqrt(channel_variance(experiment)[:6]) * unit
        for experiment, unit in zip(outcome.experiments, found[TARE].reshape(count, 6), strict=True)
    ]
    slopes = [p.slope for p in last.free_parameters]
    names = [p.name for p in outcome.settings.free]
    weights = np.concatenate(
        [w[np.isfinite(measured_rows(e))] for w, e in zip(outcome.weights, outcome.experiments, strict=True)]
    )
    return Floated(
        tares=tuple(tares),
        rest_offsets=(deviation[6:] * found[REST_POSITIONS]).reshape(-1, 3),
        force_gain=GAIN_STD * float(found[FORCE_GAIN][0]),
        discretisation=dict(zip(names, (outcome.discretisation * slopes).tolist(), strict=True)),
        least_weight=float(weights.min()),
        rejected_share=float(np.mean(weights < _REJECTED)),
    )


def _fit_of(outcome: FitOutcome, number: int) -> ExperimentFit:
    experiment, schedule = outcome.experiments[number], outcome.model.schedules[number]
    by_state, std_by_state = [], []
    for state, rows_of_state in enumerate(schedule.rows_per_state):
        observation = outcome.problem.predictions[number][state]
        moved = sum(
            (
                channels_by(observation, p.name) * (outcome.values[p.name] - outcome.linearised_at[p.name])
                for p in outcome.settings.free
            ),
            start=outcome.change[number, state],
        )
        by_state.append(predicted_channels(observation) + moved)
        std_by_state.append(row_deviation(experiment, observation, int(rows_of_state)))
    rows = np.array(by_state)[schedule.state_of_row]
    std = np.array(std_by_state)[schedule.state_of_row]
    return ExperimentFit(
        experiment,
        rows[:, :6],
        rows[:, 6:].reshape(experiment.fiducials.shape),
        np.array([outcome.model.deformed(number, state) for state in range(len(schedule.poses))]),
        schedule.state_of_row,
        std[:, :6],
        std[:, 6:].reshape(experiment.fiducials.shape),
    )


def _profiled(
    parameter: FreeParameter, profile: Profile, linear: ParameterEstimate, bias_std: float
) -> ParameterEstimate:
    """Return the estimate with the interval of its profile, widened by the bias of the discretisation."""
    best = parameter.at(linear.value)
    ends = []
    for end in profile.interval95:
        way = best.at(end).internal - best.internal
        ends.append(best.after(float(np.copysign(np.hypot(way, Z95 * bias_std), way))).value)
    return replace(linear, interval95=(ends[0], ends[1]))


def _rms(values: FloatArray) -> float:
    measured = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(measured**2))) if len(measured) else float("nan")
