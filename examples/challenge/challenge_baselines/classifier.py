"""Entry 2: a classifier trained on opened cases of the benchmark's own maker.

    python -m challenge_baselines.classifier CASES READINGS --opened READINGS KEYS --out answers.json

Multinomial logistic regression on readings, its strength and temperature chosen by cross-validation; E and ν by ridge
regression of what the block misses, with intervals of what cross-validation leaves.
"""

import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.model_selection import KFold, StratifiedKFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from challenge_baselines.answers_file import CaseAnswer, Interval, write_answers
from challenge_baselines.case_folder import FloatArray
from challenge_baselines.options import task_of
from challenge_baselines.reading import Reading
from challenge_baselines.readings_file import Opened
from challenge_baselines.thresholds import LABELS, gains_of

_STRENGTHS = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
_FOLDS = 5
_FLOOR = 1e-3
_RIDGE = 30.0

ABOUT = {
    "name": "trained classifier",
    "authors": ["the project that keeps the benchmark"],
    "method": "Multinomial logistic regression on the readings of the residual thresholds, with a temperature from "
    "cross-validation; ridge regression of E and ν with intervals of the cross-validated errors (scikit-learn).",
    "trained_on": "opened cases of the same maker, other seeds, coarse mesh",
}


def main(arguments: list[str]) -> int:
    """Train, and answer a sealed set."""
    task = task_of(arguments, "Answer a sealed set by a classifier trained on opened ones.")
    single = [one for one in task.opened if len(one.effects) < 2]
    names = np.array([one.label for one in single])
    known = np.array([features(one.reading) for one in single])
    model, temperature, score = trained(known, names)
    print(
        f"{len(single)} opened cases; log score by cross-validation {score:.2f}, temperature {temperature:.2f}"
    )
    material = Material(task.opened)
    answers = {}
    for name, timed in task.readings.items():
        began = time.process_time()
        own = features(timed.reading)[None]
        shares = tempered(model.predict_proba(own), temperature)[0]
        probabilities = {
            **dict.fromkeys(LABELS, 0.0),
            **dict(zip(model.classes_, map(float, shares), strict=True)),
        }
        modulus, ratio = material.of(timed.reading)
        seconds = timed.seconds + time.process_time() - began
        answers[name] = CaseAnswer(probabilities, modulus, ratio, seconds)
    write_answers(task.cases, ABOUT, answers, task.out)
    print(f"{len(answers)} answers in {task.out}")
    return 0


def features(reading: Reading) -> FloatArray:
    """Return what the classifier sees of a case: logarithms of gains and misfits, and a few facts."""
    gains = gains_of(reading)
    logs = np.log([max(gains[label], 1e-2) for label in sorted(gains)])
    # how far each stands above what is usual in this case
    misfits = np.log(np.maximum(reading.misfits, 1e-2))
    facts = [np.log1p(reading.facts[0]), *reading.facts[1:5], np.log(reading.facts[5])]
    return np.concatenate(
        [logs, logs - np.median(logs), misfits, reading.oddest_bead, facts, [reading.poisson_ratio]]
    )


def trained(known: FloatArray, names: np.ndarray) -> tuple[Any, float, float]:
    """Return the classifier, its temperature, and its log score in cross-validation."""
    classes = np.unique(names)
    folds = StratifiedKFold(_FOLDS, shuffle=True, random_state=0)
    truth = np.searchsorted(classes, names)
    found = []
    for strength in _STRENGTHS:
        model = make_pipeline(StandardScaler(), LogisticRegression(C=strength, max_iter=2000))
        shares = cross_val_predict(model, known, names, cv=folds, method="predict_proba")
        temperature = _best_temperature(shares, truth)
        found.append((_log_score(tempered(shares, temperature), truth), temperature, strength))
    score, temperature, strength = max(found)
    model = make_pipeline(StandardScaler(), LogisticRegression(C=strength, max_iter=2000)).fit(known, names)
    return model, temperature, score


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
