"""The least-squares problem of a case on a choice of its states, as a function of the parameters."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimator.errors import FitError
from estimator.experiment import Experiment
from estimator.fem.equilibrium.newton import NewtonSettings
from estimator.fit.gauss_newton import marginal_step
from estimator.fit.losses import LINEAR
from estimator.fit.nuisances import GRIPPER_POSITION, floating, nuisance_columns
from estimator.fit.paper import paper_covariance, paper_system
from estimator.fit.residuals import (
    Predictions,
    Roots,
    StateMean,
    WhitenedSystem,
    channels_by,
    covariance_roots,
    measured_rows,
    predicted_channels,
    state_means,
    whiten,
)
from estimator.fit.row_residuals import row_deviation, row_residuals
from estimator.fit.settings import FitSettings
from estimator.forward.model import ForwardModel

FloatArray = NDArray[np.float64]
Values = dict[str, float]
# Called with what is being done, how many of its states are done, and how many there are.
Progress = Callable[[str, int, int], None]


def silent(stage: str, done: int, total: int) -> None:
    """Tell nothing: nobody watches."""


_EXACT = NewtonSettings()
_REWEIGHTINGS = 50
_STEADY_WEIGHT = 1e-3


class Linearisation:
    """Solves the states when it is asked for a new point, and keeps what it found there.

    Parameters
    ----------
    model : of the experiments
    means : of all states, measured
    selection : for each experiment the states in use
    stage, tell : for progress
    newton : how exactly states are solved

    Attributes
    ----------
    predictions : at the last point
    means : as they were given, but for weights and corrections
    roots : of the covariances of the first predictions
    """

    def __init__(
        self,
        model: ForwardModel,
        means: Sequence[StateMean],
        selection: Sequence[Sequence[int]],
        settings: FitSettings,
        stage: str,
        tell: Progress,
        newton: NewtonSettings = _EXACT,
    ) -> None:
        self._model, self._selection, self._settings = model, selection, settings
        self._tell, self._newton = partial(tell, stage), newton
        self._nuisances = floating(settings.nuisances)
        self._point: Values | None = None
        self._correction: Mapping[tuple[int, int], FloatArray] = {}
        self.means = self._trusted(means)
        self.predictions: Predictions = []
        self.roots: Roots = {}

    def likelihood(self, values: Values) -> WhitenedSystem:
        """Return the whitened problem with its nuisances, and a row for each prior."""
        self._predict(values)
        if not self.roots:
            self.roots = covariance_roots(self.means, self.predictions)
        system = whiten(self.means, self.predictions, self._slopes(values), self.roots, self._nuisances)
        return with_priors(system, self._settings, values)

    def paper(self, values: Values) -> WhitenedSystem:
        """Return the problem of the paper's objective."""
        self._predict(values)
        return paper_system(
            self.means, self.predictions, self._slopes(values), self._model.problem.fiducials_rest
        )

    @property
    def objective(self) -> Callable[[Values], WhitenedSystem]:
        """The problem of the objective that the settings name."""
        return {"likelihood": self.likelihood, "paper": self.paper}[self._settings.objective]

    def covariance(self, values: Values) -> FloatArray:
        """Return the covariance (p, p) of the objective's estimate, internal variables, under the stated noise."""
        system = self.likelihood(values)
        if self._settings.objective == "likelihood":
            return marginal_step(system, self._settings.free, values).covariance
        rest = self._model.problem.fiducials_rest
        return paper_covariance(
            self.means, self.predictions, self._slopes(values), rest, self.roots, self._nuisances
        )

    def correct(self, change: Mapping[tuple[int, int], FloatArray]) -> None:
        """Take what a finer mesh changes in the prediction of every state, (c,), off the measurements.

        An earlier correction is taken back.
        """
        earlier, self._correction = self._correction, change
        self.means = [
            replace(
                m, mean=m.mean + earlier.get((m.experiment, m.state), 0.0) - change[m.experiment, m.state]
            )
            for m in self.means
        ]

    def row_residuals(self, experiments: Sequence[Experiment], values: Values) -> list[FloatArray]:
        """Return what the linearised fit leaves of each row, (n, c) in units of its noise."""
        schedules = self._model.schedules
        expected = self._expected(values)
        deviations = {
            (number, state): row_deviation(
                experiments[number],
                self.predictions[number][state],
                int(schedules[number].rows_per_state[state]),
            )
            for number, state in expected
        }
        return row_residuals(experiments, schedules, expected, deviations)

    def reweigh(self, experiments: Sequence[Experiment], values: Values) -> list[FloatArray]:
        """Renew the weights of all rows until they agree with the residuals that the linearised fit leaves.

        Returns
        -------
        weights : for each experiment (n, c)
        """
        loss, schedules = self._settings.loss, self._model.schedules
        weights = [np.isfinite(measured_rows(experiment)).astype(np.float64) for experiment in experiments]
        if loss == LINEAR:
            return weights
        for _ in range(_REWEIGHTINGS):
            residuals = self.row_residuals(experiments, values)
            renewed = [np.where(np.isfinite(r), loss.weight(np.nan_to_num(r)), 0.0) for r in residuals]
            moved = max(float(np.abs(a - b).max()) for a, b in zip(renewed, weights, strict=True))
            weights = renewed
            self.means = self._trusted(state_means(experiments, schedules, weights))
            correction, self._correction = self._correction, {}
            if correction:
                self.correct(correction)
            self.roots = covariance_roots(self.means, self.predictions)
            if moved < _STEADY_WEIGHT:
                break
        return weights

    def first_guess(self) -> Values:
        """Return the start with E from one prediction: every force is proportional to it.

        Raises
        ------
        FitError
            The measured forces do not oppose the motion.
        """
        values = self._settings.start
        self._predict(values)
        measured_by_predicted, predicted_squared = 0.0, 0.0
        for mean in self.means:
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
        ratio = measured_by_predicted / predicted_squared
        modulus = [p for p in self._settings.free if p.name == "youngs_modulus"]
        return {**values, **{p.name: min(max(ratio * values[p.name], p.lower), p.upper) for p in modulus}}

    def _expected(self, values: Values) -> dict[tuple[int, int], FloatArray]:
        """Return the channels (c,) of every state at the linearised optimum, nuisances and corrections included."""
        step = marginal_step(self.likelihood(values), self._settings.free, values)
        slopes = self._slopes(values)
        expected = {}
        for mean in self.means:
            observation = self.predictions[mean.experiment][mean.state]
            key = mean.experiment, mean.state
            deviation = np.sqrt(mean.variance)
            columns = nuisance_columns(
                self._nuisances, deviation, observation, mean.experiment, len(self.predictions)
            )
            expected[key] = predicted_channels(observation) + columns @ step.nuisances
            for change, (name, slope) in zip(step.step, slopes.items(), strict=True):
                expected[key] += change * slope * channels_by(observation, name)
            if key in self._correction:
                expected[key] += self._correction[key]
        return expected

    def _trusted(self, means: Sequence[StateMean]) -> list[StateMean]:
        if GRIPPER_POSITION in self._settings.nuisances:
            return list(means)
        return [replace(mean, position_variance=0.0) for mean in means]

    def _slopes(self, values: Values) -> dict[str, float]:
        return {p.name: p.slope(values[p.name]) for p in self._settings.free}

    def _predict(self, values: Values) -> None:
        if values != self._point:
            material = self._settings.material(values)
            self.predictions = self._model.predict(material, self._selection, self._tell, self._newton)
            self._point = dict(values)


def prior_information(settings: FitSettings, values: Values) -> FloatArray:
    """Return the information (p, p) that the priors give on the internal variables."""
    free = settings.free
    deviations = [settings.priors[p.name].std if p.name in settings.priors else np.inf for p in free]
    slopes = np.array([p.slope(values[p.name]) for p in free])
    return np.diag(np.square(slopes / deviations))


def with_priors(system: WhitenedSystem, settings: FitSettings, values: Values) -> WhitenedSystem:
    """Return the system with a row for each prior."""
    if not settings.priors:
        return system
    names = [parameter.name for parameter in settings.free]
    rows = np.zeros((len(settings.priors), len(names)))
    residual = np.zeros(len(settings.priors))
    for n, (name, prior) in enumerate(settings.priors.items()):
        column = names.index(name)
        rows[n, column] = settings.free[column].slope(values[name]) / prior.std
        residual[n] = (prior.mean - values[name]) / prior.std
    return WhitenedSystem(
        np.concatenate([system.residual, residual]),
        np.vstack([system.by_parameter, rows]),
        np.vstack([system.by_nuisance, np.zeros((len(rows), system.by_nuisance.shape[1]))]),
    )
