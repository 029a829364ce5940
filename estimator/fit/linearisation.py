"""The least-squares problem of a case on a choice of its states, as a function of the parameters."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment
from estimator.fem.equilibrium.newton import NewtonSettings
from estimator.fit.first_guess import NothingTellsModulusError, modulus_ratio
from estimator.fit.linearised_fit import LinearisedFit, Predictions, Whitenings, linearised_fit, whitenings_of
from estimator.fit.losses import LINEAR
from estimator.fit.measurements import StateMean, row_deviation, row_residuals, state_means
from estimator.fit.nuisances import GRIPPER_POSITION, floating, nuisance_columns
from estimator.fit.paper.objective import paper_covariance, paper_gains, paper_system
from estimator.fit.search import Values, at_values, determined_step
from estimator.fit.settings import FitSettings
from estimator.forward.model import ForwardModel
from estimator.inference.channels import channel_variance, channels_by, measured_rows, predicted_channels
from estimator.inference.free_parameter import FreeParameter
from estimator.inference.material_parameters import YOUNGS_MODULUS

FloatArray = NDArray[np.float64]
# Called with what is being done, how many of its states are done, and how many there are.
Progress = Callable[[str, int, int], None]


def silent(stage: str, done: int, total: int) -> None:
    """Tell nothing: nobody watches."""


_EXACT = NewtonSettings()
_REWEIGHTINGS = 50
# Beside weight a first guess of E is improved on until it changes by less than this factor's logarithm.
_NEAR, _GUESSES = 0.1, 6
_STEADY_WEIGHT = 1e-3


class Linearisation:
    """Solves the states when it is asked for a new point, and keeps what it found there.

    Parameters
    ----------
    model : of the experiments
    means : of all states, measured
    selection : for each experiment the states in use
    tell : called with how many states are solved, and how many there are
    newton : how exactly states are solved

    Attributes
    ----------
    predictions : at the last point
    means : as they were given, but for weights and corrections
    whitenings : of the states, by the first predictions
    """

    def __init__(
        self,
        model: ForwardModel,
        means: Sequence[StateMean],
        selection: Sequence[Sequence[int]],
        settings: FitSettings,
        tell: Callable[[int, int], None],
        newton: NewtonSettings = _EXACT,
    ) -> None:
        self._model, self._selection, self._settings = model, selection, settings
        self._tell, self._newton = tell, newton
        self._nuisances = floating(settings.nuisances)
        self._point: Values | None = None
        self._correction: Mapping[tuple[int, int], FloatArray] = {}
        self.means = self._trusted(means)
        self.predictions: Predictions = []
        self.whitenings: Whitenings = {}

    def likelihood(self, values: Values) -> LinearisedFit:
        """Return the problem whitened by the sensors' noise and the nuisances."""
        self._predict(values)
        if not self.whitenings:
            self.whitenings = whitenings_of(self.means, self.predictions)
        return linearised_fit(
            self.means, self.predictions, self._free(values), self.whitenings, self._nuisances
        )

    def paper(self, values: Values) -> LinearisedFit:
        """Return the problem of the paper's objective."""
        self._predict(values)
        rest = self._model.problem.fiducials_rest
        return paper_system(self.means, self.predictions, self._free(values), rest)

    @property
    def objective(self) -> Callable[[Values], LinearisedFit]:
        """The problem of the objective that the settings name."""
        return {"likelihood": self.likelihood, "paper": self.paper}[self._settings.objective]

    def covariance(self, values: Values) -> FloatArray:
        """Return the covariance (p, p) of the objective's estimate, internal variables, under the stated noise."""
        problem = self.likelihood(values)
        if self._settings.objective == "likelihood":
            return determined_step(problem).covariance
        rest = self._model.problem.fiducials_rest
        gains = paper_gains(self.means, self.predictions, problem.free_parameters, rest)
        return paper_covariance(self.means, self.predictions, gains, self.whitenings, self._nuisances)

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
            self.whitenings = whitenings_of(self.means, self.predictions)
            if moved < _STEADY_WEIGHT:
                break
        return weights

    def noise_ratio(
        self, experiments: Sequence[Experiment], weights: Sequence[FloatArray], values: Values, chi2: float
    ) -> float:
        """Return the root mean square of all residuals, tares and offsets taken out, in units of the stated noise.

        The misfit of the state means and the scatter of the rows about them add up to that of all rows. Under a robust
        loss residuals count by their weights, and the ratio is that by which an estimate scatters more than these say.

        Parameters
        ----------
        experiments : whose rows they are
        weights : for each those of its rows' channels, (n, c)
        values : where the problem is linearised
        chi2 : misfit of the state means at the optimum
        """
        squares, count = chi2, 0.0
        for experiment, schedule, own in zip(experiments, self._model.schedules, weights, strict=True):
            rows = measured_rows(experiment) / np.sqrt(channel_variance(experiment))
            weight = np.where(np.isfinite(rows), own, 0.0)
            squares += _scatter(np.nan_to_num(rows), weight, schedule.state_of_row)
            count += float(weight.sum())
        residuals = self.row_residuals(experiments, values)
        every = np.concatenate([residual[np.isfinite(residual)] for residual in residuals])
        factor = self._settings.loss.variance_factor(every)
        return float(np.sqrt(factor * squares / max(count - len(self._settings.free), 1.0)))

    def first_guess(self) -> Values:
        """Return the start with E from one prediction; where that tells nothing, the mean of its prior.

        Raises
        ------
        FitError
            No force was measured, or none that opposes the motion, and nothing else is known of E.
        """
        values = self._settings.start
        modulus = next((p for p in self._settings.free if p.name == YOUNGS_MODULUS.name), None)
        if modulus is None:
            return values
        for _ in range(_GUESSES):
            self._predict(values)
            try:
                ratio = modulus_ratio(
                    self.means, self.predictions, self._model.schedules, values[modulus.name]
                )
            except NothingTellsModulusError:
                if modulus.prior is None:
                    raise
                return values
            values = {**values, modulus.name: modulus.at(ratio * values[modulus.name]).value}
            if not self._model.problem.heavy or abs(np.log(ratio)) < _NEAR:
                break
        return values

    def _expected(self, values: Values) -> dict[tuple[int, int], FloatArray]:
        """Return the channels (c,) of every state at the linearised optimum, nuisances and corrections included."""
        problem = self.likelihood(values)
        step = determined_step(problem).step
        nuisances = problem.nuisances_after(step)
        expected = {}
        for mean in self.means:
            observation = self.predictions[mean.experiment][mean.state]
            key = mean.experiment, mean.state
            deviation = np.sqrt(mean.variance)
            columns = nuisance_columns(
                self._nuisances, deviation, observation, mean.experiment, len(self.predictions)
            )
            expected[key] = predicted_channels(observation) + columns @ nuisances
            for change, parameter in zip(step, problem.free_parameters, strict=True):
                expected[key] += change * parameter.slope * channels_by(observation, parameter.name)
            if key in self._correction:
                expected[key] += self._correction[key]
        return expected

    def _trusted(self, means: Sequence[StateMean]) -> list[StateMean]:
        """Return the means with what of the pose's error counts beside their own scatter.

        Where a gripper that the robot drives is says the robot, as surely as it states, however far the rest scatters.
        """
        if GRIPPER_POSITION not in self._settings.nuisances:
            return [replace(mean, pose_variance=np.zeros(6)) for mean in means]
        share = 1.0 / self._settings.prior_weight**2
        return [
            mean
            if self._model.driven_by_load[mean.experiment]
            else replace(mean, pose_variance=share * mean.pose_variance)
            for mean in means
        ]

    def _free(self, values: Values) -> tuple[FreeParameter, ...]:
        return at_values(self._settings.free, values)

    def _predict(self, values: Values) -> None:
        if values != self._point:
            material = self._settings.material(values)
            self.predictions = self._model.predict(material, self._selection, self._tell, self._newton)
            self._point = dict(values)


def _scatter(rows: FloatArray, weight: FloatArray, state_of_row: NDArray[np.int64]) -> float:
    """Return the weighted sum of the squares of rows (n, c) about the means of their states."""
    found = 0.0
    for state in np.unique(state_of_row):
        own, of_own = rows[state_of_row == state], weight[state_of_row == state]
        total = of_own.sum(axis=0)
        mean = (of_own * own).sum(axis=0) / np.where(total > 0, total, 1.0)
        found += float(np.sum(of_own * (own - mean) ** 2))
    return found
