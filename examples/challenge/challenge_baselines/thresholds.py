"""Entry 1: a cause is named where its template explains more than it does in any clean case.

    python -m challenge_baselines.thresholds CASES READINGS --opened READINGS KEYS --out answers.json

Nothing is learned but limits, one for each label, and how often the first, second, ... beyond theirs is right.
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from challenge_baselines.answers_file import CaseAnswer, Interval, write_answers
from challenge_baselines.options import task_of
from challenge_baselines.reading import Reading
from challenge_baselines.readings_file import NONE, UNKNOWN, Opened
from challenge_baselines.templates import TEMPLATES

MISLABEL, MISREAD = "fiducial_mislabel", "fiducial_misread"
WITHOUT_TEMPLATE = ("second_invariant",)
LABELS = (*TEMPLATES, MISLABEL, MISREAD, *WITHOUT_TEMPLATE)

_RANKS = 6
_SMOOTHING = 0.5

ABOUT = {
    "name": "residual thresholds",
    "authors": ["the project that keeps the benchmark"],
    "method": "A linear-elastic block is fitted; a cause is named where its first-order template explains more of the "
    "residual than in any of the opened clean cases. Probabilities are how often that was right in the opened cases.",
    "trained_on": "opened cases of the same maker, other seeds, coarse mesh",
}


@dataclass(frozen=True)
class Limits:
    """What clean cases reach.

    Attributes
    ----------
    gains : by label, the largest of its template's F statistic, and of what an odd bead shows
    misfit : the largest root mean square that is left, σ, of forces, torques and beads
    """

    gains: dict[str, float]
    misfit: tuple[float, ...]


@dataclass(frozen=True)
class Habits:
    """How often answers were right in the opened cases, by whether a limit was passed.

    Attributes
    ----------
    alarmed, silent : probability of the first, second, ... label, then of none and of unknown
    """

    alarmed: tuple[float, ...]
    silent: tuple[float, ...]


def main(arguments: list[str]) -> int:
    """Answer a sealed set."""
    task = task_of(arguments, "Answer a sealed set by thresholds on residuals.")
    limits = limits_of([one.reading for one in task.opened if not one.effects])
    habits = habits_of([one for one in task.opened if len(one.effects) < 2], limits)
    modulus, ratio = _scatter(task.opened)
    answers = {}
    for name, timed in task.readings.items():
        began = time.process_time()
        reading = timed.reading
        probabilities = answer(reading, limits, habits)
        e = [reading.youngs_modulus * factor for factor in modulus]
        nu = [float(np.clip(reading.poisson_ratio + shift, 0.0, 0.5)) for shift in ratio]
        seconds = timed.seconds + time.process_time() - began
        answers[name] = CaseAnswer(
            probabilities, Interval(e[1], e[0], e[2]), Interval(nu[1], nu[0], nu[2]), seconds
        )
    write_answers(task.cases, ABOUT, answers, task.out)
    print(f"{len(answers)} answers in {task.out}")
    return 0


def gains_of(reading: Reading) -> dict[str, float]:
    """Return how much speaks for each label that can be told."""
    share, constant = reading.oddest_bead
    beads = reading.facts[0]
    odd = share * beads if beads > 1 else 0.0
    return {**reading.gains, MISLABEL: odd * constant, MISREAD: odd * (1.0 - constant)}


def limits_of(clean: Sequence[Reading]) -> Limits:
    """Return the limits that no clean case passes."""
    gains = [gains_of(reading) for reading in clean]
    return Limits(
        {label: max(one[label] for one in gains) for label in gains[0]},
        tuple(float(one) for one in np.max([reading.misfits for reading in clean], axis=0)),
    )


def ranking(reading: Reading, limits: Limits) -> tuple[list[str], bool]:
    """Return labels, the one furthest beyond its limit first, and whether any limit is passed."""
    beyond = {label: gain / max(limits.gains[label], 1e-9) for label, gain in gains_of(reading).items()}
    order = sorted(beyond, key=lambda label: -beyond[label])
    too_large = any(left > limit for left, limit in zip(reading.misfits, limits.misfit, strict=True))
    return order, beyond[order[0]] > 1.0 or too_large


def habits_of(opened: Sequence[Opened], limits: Limits) -> Habits:
    """Return how often each rank, none and unknown were right, of cases that pass a limit and of others."""
    counts = {True: np.full(_RANKS + 2, _SMOOTHING), False: np.full(_RANKS + 2, _SMOOTHING)}
    for one in opened:
        order, alarm = ranking(one.reading, limits)
        if one.label == NONE:
            counts[alarm][_RANKS] += 1
        elif one.label == UNKNOWN:
            counts[alarm][_RANKS + 1] += 1
        else:
            place = order.index(one.label) if one.label in order else _RANKS
            counts[alarm] += np.eye(_RANKS + 2)[place] if place < _RANKS else 0.0
    whole = {
        alarm: max(sum(ranking(one.reading, limits)[1] == alarm for one in opened), 1) for alarm in counts
    }
    found = {alarm: count / (whole[alarm] + _SMOOTHING * len(count)) for alarm, count in counts.items()}
    return Habits(tuple(map(float, found[True])), tuple(map(float, found[False])))


def answer(reading: Reading, limits: Limits, habits: Habits) -> dict[str, float]:
    """Return probabilities by label."""
    order, alarm = ranking(reading, limits)
    shares = habits.alarmed if alarm else habits.silent
    found = {
        **dict(zip(order[:_RANKS], shares, strict=False)),
        NONE: shares[_RANKS],
        UNKNOWN: shares[_RANKS + 1],
    }
    others = [label for label in LABELS if label not in found]
    left = max(1.0 - sum(found.values()), 0.01)
    return {**found, **dict.fromkeys(others, left / len(others))}


def _scatter(opened: Sequence[Opened]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return 2.5, 50 and 97.5 % of by what E of the block is to be multiplied, and of what is to be added to ν."""
    factors = [one.youngs_modulus / one.reading.youngs_modulus for one in opened]
    shifts = [one.poisson_ratio - one.reading.poisson_ratio for one in opened]
    return tuple(np.percentile(factors, [2.5, 50, 97.5])), tuple(np.percentile(shifts, [2.5, 50, 97.5]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
