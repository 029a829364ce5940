"""Material parameters from retractions: the estimation as a whole.

It goes from coarse to fine: a few states of each experiment until that converges, then all states, then the
discretisation error, measured on a finer mesh, corrected for, and kept as an uncertainty.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimator.errors import FitError
from estimator.experiment import Experiment, check_same_mounting
from estimator.experiment.as_modelled import as_modelled
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.newton import NewtonSettings
from estimator.fit.linearisation import Linearisation, Progress, silent
from estimator.fit.measurements import StateMean, state_means
from estimator.fit.nuisances import DISCRETISATION, GRIPPER_POSITION, REMAINING_ERROR
from estimator.fit.paper.sqp import minimise_by_sqp
from estimator.fit.profile import Profile, profile
from estimator.fit.result import Estimate
from estimator.fit.search import Iterate, Values, determined_step, internal_change, minimise, moved
from estimator.fit.settings import FitSettings
from estimator.fit.summary import FitOutcome, Uncertainty, budget, summarise, uncertainty
from estimator.forward.advice import advising
from estimator.forward.finer import measuring_mesh
from estimator.forward.meshing import mesh_experiment
from estimator.forward.model import ForwardModel
from estimator.forward.schedule import spread_states
from estimator.inference.discretisation import change_in_another_model
from estimator.inference.gauss_newton import NewtonStep

FloatArray = NDArray[np.float64]

_FEWEST_STATES = 2
# Where a search begins, states need not be solved to the last digit.
_AT_FIRST = NewtonSettings(tolerance=1e-6, chord_rate=0.3, tangent_reuse=1e-3)
# A tangent that was assembled at such a residual gives derivatives to about a thousandth, of steps below a tenth.
_AT_LAST = NewtonSettings(tangent_reuse=1e-3)
# A change of an internal variable this small is taken by the linearisation alone: its error is the square of it.
_LINEAR_STEP = 0.01
# A correction for the discretisation error this small is taken linearly too: the bias that is kept is larger by far.
_LINEAR_CORRECTION = 0.1
# One that moved the parameters by more has carried them to where the error is another one: it is measured again there.
_MEASURED_NEARBY = 0.3
# Rounds of parameters in turn with weights, or with corrections; what one of them leaves, the next mostly takes away.
_ROUNDS = 4
_STEADY_WEIGHT = 0.02
# Every recording sees the beads anew at rest, with noise and after some creep; a new mounting moves them by more.
_SAME_MOUNTING_M = 3e-4
# A misfit that is other by this factor gives priors another weight.
_STANDS_OUT = 1.5
_SEARCHES: dict[str, Callable[..., tuple[list[Iterate], NewtonStep]]] = {
    "likelihood": minimise,
    "paper": minimise_by_sqp,
}


def estimate(
    experiments: Sequence[Experiment],
    progress: Progress | None = None,
    settings: FitSettings | None = None,
    mesh: Callable[[Experiment], RetractionProblem] = mesh_experiment,
    finer_mesh: Callable[[Experiment], RetractionProblem] = measuring_mesh,
) -> Estimate:
    """Estimate the free parameters from the experiments of one phantom in one mounting.

    Parameters
    ----------
    experiments : with the same phantom, anchors, grasp and fiducials
    progress : told about every solved state
    settings : by default E and ν of the Neo-Hookean law, by maximum likelihood
    mesh : of the phantom
    finer_mesh : that its discretisation error is measured against, at a few states

    Raises
    ------
    InputError
        There is no experiment, they are not of one phantom, or they cannot be meshed.
    FitError
        The data do not determine the parameters, or the fit does not converge.
    SolverError
        The motion has no equilibrium at the first guess.
    """
    started = time.perf_counter()
    settings = settings or FitSettings()
    experiments = [as_modelled(experiment) for experiment in experiments]
    check_same_mounting(experiments, _SAME_MOUNTING_M)
    tell = progress or silent
    model = ForwardModel(mesh(experiments[0]), experiments)
    means = state_means(experiments, model.schedules)
    with advising(experiments):
        rough, settings = fit_few_states(model, means, tell, settings)

    everything = [list(range(len(s.poses))) for s in model.schedules]
    every = Linearisation(model, means, everything, settings, partial(tell, "all states"), _AT_LAST)
    fine, weights = _search_robustly(every, experiments, settings, rough[-1].values)
    chi2 = determined_step(every.objective(fine[-1].values)).chi2_after
    weighed = _with_priors_weighed(settings, every.noise_ratio(experiments, weights, fine[-1].values, chi2))
    if weighed is not settings:
        settings = weighed
        every = Linearisation(model, means, everything, settings, partial(tell, "all states"), _AT_LAST)
        again, weights = _search_robustly(every, experiments, settings, fine[-1].values)
        fine += again[1:]
    values, solved = fine[-1].values, 0
    change = {(m.experiment, m.state): np.zeros(len(m.mean)) for m in means}
    last = determined_step(every.objective(values))
    uncorrected = moved(settings.free, values, last.step)
    if DISCRETISATION in settings.nuisances:
        finer = ForwardModel(finer_mesh(experiments[0]), experiments)
        for _ in range(_ROUNDS):
            before = values
            change = change_in_another_model(
                finer, settings.material(values), every.predictions, partial(tell, "finer mesh")
            )
            every.correct(change)
            last = determined_step(every.objective(values))
            if last.length > _LINEAR_CORRECTION:
                more, last = _SEARCHES[settings.objective](
                    every.objective, settings.free, values, _LINEAR_STEP
                )
                fine += more[1:]
                values = more[-1].values
            if float(np.abs(internal_change(settings.free, before, values)).max()) < _MEASURED_NEARBY:
                break
        solved = finer.solved_states
    final = moved(settings.free, values, last.step)
    correction = internal_change(settings.free, uncorrected, final)
    outcome = FitOutcome(
        experiments=tuple(experiments),
        model=model,
        settings=settings,
        problem=every,
        linearised_at=values,
        values=final,
        iterates=(*rough, *fine[1:], Iterate(final, last.chi2_after)),
        weights=weights,
        change=change,
        discretisation=correction,
        bias_std=REMAINING_ERROR * correction,
        finer_solves=solved,
    )
    found = uncertainty(outcome)
    profiles = _profiles(every, settings, values, found) if settings.intervals == "profile" else []
    summary = summarise(outcome, found, profiles, started)
    if settings.budget is None:
        return summary
    of_bodies = partial(tell, "bodies of other geometry")
    return replace(summary, budget=budget(outcome, found, settings.budget, of_bodies))


def fit_few_states(
    model: ForwardModel,
    means: Sequence[StateMean],
    tell: Progress,
    settings: FitSettings | None = None,
) -> tuple[list[Iterate], FitSettings]:
    """Fit the free parameters to a few states of each experiment.

    As many states as parameters will do: each says more than one thing.

    Returns
    -------
    iterates : every point on the way, the best last
    settings : with priors as sure as they are beside such a misfit

    Raises
    ------
    FitError
        The measured forces do not oppose the motion, or the fit does not converge.
    """
    settings = settings or FitSettings()
    chosen = [spread_states(s, max(_FEWEST_STATES, len(settings.free))) for s in model.schedules]
    few = Linearisation(model, means, chosen, settings, partial(tell, "a few states"), _AT_FIRST)
    search = _SEARCHES[settings.objective]
    start = few.first_guess()
    first = few.objective(start)
    count = max(len(first.residual[0]) - len(settings.free), 1)
    found: list[Iterate] = []
    try:
        found, last = search(few.objective, settings.free, start, _LINEAR_STEP)
    except FitError:
        # Beside what the model misses the priors weigh too little, and what is not determined runs away.
        last = determined_step(first)
        if _with_priors_weighed(settings, _in_noise(last, count)) is settings:
            raise
    weighed = _with_priors_weighed(settings, _in_noise(last, count))
    if weighed is not settings:
        few = Linearisation(model, means, chosen, weighed, partial(tell, "a few states"), _AT_FIRST)
        again, _ = search(few.objective, weighed.free, start, _LINEAR_STEP)
        found += again
    return found, weighed


def _in_noise(last: NewtonStep, count: int) -> float:
    """Return the root mean square misfit of so many values in units of the noise, after the last step."""
    return float(np.sqrt(last.chi2_after / count))


def _with_priors_weighed(settings: FitSettings, misfit: float) -> FitSettings:
    """Return the settings with priors as sure as they are beside a misfit, in units of the noise; as they are if near.

    Where the measurements scatter more than stated they say as much less, and a prior as much more beside them.
    """
    weight = max(1.0, misfit)
    near = max(weight, settings.prior_weight) < _STANDS_OUT * min(weight, settings.prior_weight)
    known = any(parameter.prior is not None for parameter in settings.free)
    known |= settings.objective == "likelihood" and GRIPPER_POSITION in settings.nuisances
    return replace(settings, prior_weight=weight) if known and not near else settings


def _search_robustly(
    problem: Linearisation, experiments: Sequence[Experiment], settings: FitSettings, start: Values
) -> tuple[list[Iterate], list[FloatArray]]:
    """Search with weights and parameters renewed in turn until the weights stand still; return both.

    The linear loss leaves every weight at one, so that the first round is the last.
    """
    iterates: list[Iterate] = []
    weights: list[FloatArray] = []
    values = start
    for _ in range(_ROUNDS):
        renewed = problem.reweigh(experiments, values)
        if weights and _farthest(weights, renewed) < _STEADY_WEIGHT:
            break
        weights = renewed
        found, _ = _SEARCHES[settings.objective](problem.objective, settings.free, values, _LINEAR_STEP)
        iterates += found[1:] if iterates else found
        values = iterates[-1].values
    return iterates, weights


def _profiles(
    problem: Linearisation, settings: FitSettings, best: Values, found: Uncertainty
) -> list[Profile]:
    deviations = np.sqrt(np.diag(found.covariance)) / found.inflation
    return [
        profile(problem.likelihood, settings.free, number, best, float(deviation), found.inflation)
        for number, deviation in enumerate(deviations)
    ]


def _farthest(one: Sequence[FloatArray], other: Sequence[FloatArray]) -> float:
    return max(float(np.abs(a - b).max()) for a, b in zip(one, other, strict=True))
