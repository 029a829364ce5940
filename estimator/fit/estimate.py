"""Young's modulus and Poisson's ratio from retractions: the estimation as a whole.

It goes from coarse to fine: a few states of each experiment until that converges, then all states, then the
discretisation error, measured on a finer mesh, corrected for, and kept as an uncertainty.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimator.errors import FitError, InputError
from estimator.experiment import Experiment
from estimator.fem.observation import Observation
from estimator.fit.discretisation import change_on_finer_mesh
from estimator.fit.gauss_newton import Iterate, marginal_step, minimise, moved
from estimator.fit.parameters import POISSON_RATIO, YOUNGS_MODULUS
from estimator.fit.residuals import (
    Roots,
    StateMean,
    WhitenedSystem,
    covariance_roots,
    predicted_channels,
    state_means,
    whiten,
)
from estimator.fit.result import Estimate
from estimator.fit.summary import FitOutcome, summarise
from estimator.forward.meshing import mesh_experiment
from estimator.forward.model import ForwardModel
from estimator.forward.schedule import spread_states
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
# Called with what is being done, how many of its states are done, and how many there are.
Progress = Callable[[str, int, int], None]
Values = dict[str, float]

_PARAMETERS = (YOUNGS_MODULUS, POISSON_RATIO)
_FIRST_POISSON_RATIO = 0.4
_STATES_AT_FIRST = 4
# A relative change of E or of 1 − 2ν this small is taken by the linearisation alone: its error is the square of it.
_LINEAR_STEP = 0.01
# What remains of the discretisation error once it is corrected for, as a share of the correction: a third at second
# order with half the element size; a half is on the safe side. It is a bias, so no amount of data averages it out.
_REMAINING_ERROR = 0.5


def estimate(experiments: Sequence[Experiment], progress: Progress | None = None) -> Estimate:
    """Estimate E and ν from the experiments of one phantom in one mounting.

    Parameters
    ----------
    experiments : with the same phantom, anchors, grasp and fiducials
    progress : told about every solved state

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
    _check_one_phantom(experiments)
    tell = progress or (lambda stage, done, total: None)
    model = ForwardModel(mesh_experiment(experiments[0]), experiments)
    means = state_means(experiments, model.schedules)

    rough = fit_few_states(model, means, tell)
    every = _Linearisation(
        model, means, [list(range(len(s.poses))) for s in model.schedules], "all states", tell
    )
    fine, uncorrected = minimise(every, _PARAMETERS, rough[-1].values, _LINEAR_STEP)
    values = fine[-1].values

    change, solved = change_on_finer_mesh(
        experiments, _material(values), every.predictions, partial(tell, "finer mesh")
    )
    corrected = [replace(m, mean=m.mean - change[m.experiment, m.state]) for m in means]
    system = whiten(corrected, every.predictions, _slopes(values), every.roots)
    last = marginal_step(system, _PARAMETERS, values)
    final = moved(_PARAMETERS, values, last.step)
    outcome = FitOutcome(
        experiments=tuple(experiments),
        model=model,
        parameters=_PARAMETERS,
        values=final,
        step={name: final[name] - values[name] for name in final},
        iterates=(*rough, *fine[1:], Iterate(final, last.chi2_after)),
        predictions=every.predictions,
        change=change,
        last=last,
        bias_std=_REMAINING_ERROR * (last.step - uncorrected.step),
        forward_solves=model.solved_states + solved,
    )
    return summarise(outcome, time.perf_counter() - started)


def fit_few_states(model: ForwardModel, means: Sequence[StateMean], tell: Progress) -> list[Iterate]:
    """Fit E and ν to a few states of each experiment; return every point on the way, the best last.

    Raises
    ------
    FitError
        The measured forces do not oppose the motion, or the fit does not converge.
    """
    few = _Linearisation(
        model, means, [spread_states(s, _STATES_AT_FIRST) for s in model.schedules], "a few states", tell
    )
    return minimise(few, _PARAMETERS, few.first_guess(), _LINEAR_STEP)[0]


class _Linearisation:
    """The whitened problem on a choice of states, as a function of the parameters.

    Keeps the last predictions, and the covariances of the first.
    """

    def __init__(
        self,
        model: ForwardModel,
        means: Sequence[StateMean],
        selection: Sequence[Sequence[int]],
        stage: str,
        tell: Progress,
    ) -> None:
        self._model, self._means, self._selection = model, means, selection
        self._stage, self._tell = stage, tell
        self.predictions: list[dict[int, Observation]] = []
        self.roots: Roots = {}

    def __call__(self, values: Values) -> WhitenedSystem:
        self._predict(values)
        if not self.roots:
            self.roots = covariance_roots(self._means, self.predictions)
        return whiten(self._means, self.predictions, _slopes(values), self.roots)

    def first_guess(self) -> Values:
        """Return E from one prediction: every force is proportional to it.

        Raises
        ------
        FitError
            The measured forces do not oppose the motion.
        """
        values: Values = {"youngs_modulus": 1e4, "poisson_ratio": _FIRST_POISSON_RATIO}
        self._predict(values)
        measured_by_predicted, predicted_squared = 0.0, 0.0
        for mean in self._means:
            observation = self.predictions[mean.experiment].get(mean.state)
            if observation is not None and mean.count[:3].all():
                predicted = predicted_channels(observation)[:3]
                measured_by_predicted += float(predicted @ mean.mean[:3])
                predicted_squared += float(predicted @ predicted)
        if not measured_by_predicted > 0:
            raise FitError(
                "the measured force does not oppose the motion as an elastic tissue's would; "
                "check the sign and the axes of fx fy fz, and that the gripper holds the tissue"
            )
        return {**values, "youngs_modulus": 1e4 * measured_by_predicted / predicted_squared}

    def _predict(self, values: Values) -> None:
        self.predictions = self._model.predict(
            _material(values), self._selection, partial(self._tell, self._stage)
        )


def _material(values: Mapping[str, float]) -> Material:
    return Material(NeoHookean(), values["youngs_modulus"], values["poisson_ratio"])


def _slopes(values: Mapping[str, float]) -> dict[str, float]:
    return {p.name: p.slope(values[p.name]) for p in _PARAMETERS}


def _check_one_phantom(experiments: Sequence[Experiment]) -> None:
    if not experiments:
        raise InputError("no experiment to estimate from; name one or more experiment folders")
    first = experiments[0]
    for other in experiments[1:]:
        same = (
            other.phantom == first.phantom
            and other.anchors == first.anchors
            and other.grasp == first.grasp
            and np.array_equal(other.fiducials_rest, first.fiducials_rest)
        )
        if not same or other.phantom_id != first.phantom_id:
            raise InputError(
                f"{other.path or other.name} is not of the same mounting as {first.path or first.name} "
                "(phantom_id, phantom, anchors, grasp and fiducials must agree); estimate them one by one"
            )
