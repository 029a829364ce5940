"""Entry 2: a classifier trained on opened cases of the benchmark's own maker.

    python -m challenge_baselines.classifier CASES READINGS --opened READINGS KEYS --out answers.json

A logistic regression tells of each candidate (a label, none, unknown) whether it is right, by how far its template
stands out beside what is usual and beside the others. It shares its weights among the labels, so that a few opened
cases of each suffice. A temperature from cross-validation makes the probabilities honest. E and ν come from ridge
regression of what the block misses, with intervals of what cross-validation leaves.
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.model_selection import KFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from challenge_baselines.answers_file import CaseAnswer, Interval, write_answers
from challenge_baselines.case_folder import FloatArray
from challenge_baselines.options import task_of
from challenge_baselines.reading import Reading
from challenge_baselines.readings_file import NONE, UNKNOWN, Opened
from challenge_baselines.thresholds import LABELS, gains_of

_STRENGTHS = (0.01, 0.1, 1.0, 10.0)
_FOLDS = 5
_FLOOR = 1e-3
_RIDGE = 30.0
CANDIDATES = (NONE, UNKNOWN, *LABELS)

ABOUT = {
    "name": "trained classifier",
    "authors": ["the project that keeps the benchmark"],
    "method": "Logistic regression of whether a candidate is right on the readings of the residual thresholds, with a "
    "temperature from cross-validation; ridge regression of E and ν (scikit-learn).",
    "trained_on": "opened cases of the same maker, another seed, coarse mesh",
}


def main(arguments: list[str]) -> int:
    """Train, and answer a sealed set."""
    task = task_of(arguments, "Answer a sealed set by a classifier trained on opened ones.")
    single = [one for one in task.opened if len(one.effects) < 2]
    model, score = trained(single)
    print(
        f"{len(single)} opened cases; log score by cross-validation {score:.2f}, temperature {model.temperature:.2f}"
    )
    material = Material(task.opened)
    answers = {}
    for name, timed in task.readings.items():
        began = time.process_time()
        probabilities = dict(zip(CANDIDATES, map(float, model.shares([timed.reading])[0]), strict=True))
        modulus, ratio = material.of(timed.reading)
        seconds = timed.seconds + time.process_time() - began
        answers[name] = CaseAnswer(probabilities, modulus, ratio, seconds)
    write_answers(task.cases, ABOUT, answers, task.out)
    print(f"{len(answers)} answers in {task.out}")
    return 0


@dataclass(frozen=True)
class Usual:
    """What is usual of each label's gain and of the misfits: most causes are absent from most cases."""

    middle: FloatArray
    spread: FloatArray

    def beyond(self, reading: Reading) -> FloatArray:
        """Return by how many spreads each label's gain, then each misfit, is beyond what is usual."""
        return (logarithms(reading) - self.middle) / self.spread


@dataclass(frozen=True)
class Model:
    """A trained classifier."""

    usual: Usual
    regression: Any
    temperature: float

    def shares(self, readings: Sequence[Reading]) -> FloatArray:
        """Return the probability (n, candidates) of each candidate."""
        return tempered(_raw_shares(self.usual, self.regression, readings), self.temperature)


def logarithms(reading: Reading) -> FloatArray:
    """Return the logarithms of every label's gain and of the three misfits."""
    gains = gains_of(reading)
    told = [gains.get(label, 0.0) for label in LABELS]
    return np.log(np.maximum([*told, *reading.misfits], 1e-2))


def features(reading: Reading) -> FloatArray:
    """Return what the regression of E and ν sees of a case."""
    facts = [np.log1p(reading.facts[0]), *reading.facts[1:5], np.log(reading.facts[5])]
    return np.concatenate([logarithms(reading), reading.oddest_bead, facts, [reading.poisson_ratio]])


def candidates(beyond: FloatArray) -> FloatArray:
    """Return what speaks for each candidate (candidates, k), none and unknown first."""
    labels, misfits = beyond[:-3], beyond[-3:]
    order = np.sort(labels)
    lead = np.array([one - (order[-2] if one == order[-1] else order[-1]) for one in labels])
    rows = np.zeros((len(CANDIDATES), 9))
    rows[0, :3] = 1.0, order[-1], misfits.max()
    rows[1, 3:6] = 1.0, order[-1], misfits.max()
    rows[2:, 6:] = np.column_stack([np.ones(len(labels)), labels, lead])
    return rows


def trained(opened: Sequence[Opened]) -> tuple[Model, float]:
    """Return the classifier, and its log score in cross-validation."""
    truth = np.array([CANDIDATES.index(one.label) for one in opened])
    found = []
    for strength in _STRENGTHS:
        shares = np.zeros((len(opened), len(CANDIDATES)))
        for known, asked in KFold(_FOLDS, shuffle=True, random_state=0).split(truth):
            usual, regression = _fitted([opened[one] for one in known], strength)
            shares[asked] = _raw_shares(usual, regression, [opened[one].reading for one in asked])
        temperature = _best_temperature(shares, truth)
        found.append((_log_score(tempered(shares, temperature), truth), temperature, strength))
    score, temperature, strength = max(found)
    return Model(*_fitted(opened, strength), temperature), score


def _fitted(opened: Sequence[Opened], strength: float) -> tuple[Usual, Any]:
    logs = np.array([logarithms(one.reading) for one in opened])
    middle = np.median(logs, axis=0)
    usual = Usual(middle, np.maximum(1.5 * np.median(np.abs(logs - middle), axis=0), 0.05))
    rows = np.concatenate([candidates(usual.beyond(one.reading)) for one in opened])
    right = np.concatenate([[name == one.label for name in CANDIDATES] for one in opened])
    model = make_pipeline(StandardScaler(), LogisticRegression(C=strength, max_iter=2000))
    return usual, model.fit(rows, right)


def _raw_shares(usual: Usual, regression: Any, readings: Sequence[Reading]) -> FloatArray:
    """Return probabilities that add up to 1, before the temperature."""
    odds = [regression.predict_proba(candidates(usual.beyond(one)))[:, 1] for one in readings]
    return np.array([own / own.sum() for own in odds])


def tempered(shares: FloatArray, temperature: float) -> FloatArray:
    """Return probabilities (n, k) made flatter by a temperature above 1, and steeper by one below (Guo et al. 2017)."""
    logs = np.log(np.maximum(shares, 1e-12)) / temperature
    raised = np.exp(logs - logs.max(axis=1, keepdims=True))
    return np.asarray(raised / raised.sum(axis=1, keepdims=True))


def _best_temperature(shares: FloatArray, truth: np.ndarray) -> float:
    found = minimize_scalar(
        lambda log: -_log_score(tempered(shares, float(np.exp(log))), truth),
        bounds=(-2.0, 2.0),
        method="bounded",
    )
    return float(np.exp(found.x))


def _log_score(shares: FloatArray, truth: np.ndarray) -> float:
    return float(np.mean(np.log(np.maximum(shares[np.arange(len(truth)), truth], _FLOOR))))


class Material:
    """Regressions of what the block's E and ν miss."""

    def __init__(self, opened: Sequence[Opened]) -> None:
        known = np.array([features(one.reading) for one in opened])
        self._targets = (
            np.array([np.log(one.youngs_modulus / one.reading.youngs_modulus) for one in opened]),
            np.array([one.poisson_ratio - one.reading.poisson_ratio for one in opened]),
        )
        self._models, self._reach = [], []
        for target in self._targets:
            model = make_pipeline(StandardScaler(), Ridge(_RIDGE))
            left = target - cross_val_predict(
                model, known, target, cv=KFold(_FOLDS, shuffle=True, random_state=0)
            )
            self._models.append(model.fit(known, target))
            self._reach.append(float(np.quantile(np.abs(left), 0.95)))

    def of(self, reading: Reading) -> tuple[Interval, Interval]:
        """Return E, Pa, and ν with their intervals."""
        own = features(reading)[None]
        log, shift = (float(model.predict(own)[0]) for model in self._models)
        e, nu = reading.youngs_modulus * np.exp(log), reading.poisson_ratio + shift
        widths = np.exp(self._reach[0]), self._reach[1]
        low, middle, high = (
            float(np.clip(value, 0.0, 0.5)) for value in (nu - widths[1], nu, nu + widths[1])
        )
        return Interval(float(e), float(e / widths[0]), float(e * widths[0])), Interval(middle, low, high)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
