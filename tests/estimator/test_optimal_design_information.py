"""What experiments are expected to tell, on linear-Gaussian models whose answer is known."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.stats import norm, spearmanr

from estimator.optimal_design.information import (
    Predictive,
    best_parted,
    entropy,
    expected_information,
    log_evidence,
    updated,
)

FloatArray = NDArray[np.float64]

NOTHING = np.zeros((6, 0))
PLAIN = Predictive(np.zeros(6), NOTHING)


def along(axis: int, size: float) -> FloatArray:
    return size * np.eye(6)[axis]


def exactly(distance: float, share: float) -> float:
    """The mutual information of a binary answer and a reading of unit noise, by quadrature."""

    def density(y: float) -> float:
        return float(share * norm.pdf(y) + (1 - share) * norm.pdf(y - distance))

    of_data, _ = quad(lambda y: -density(y) * np.log(density(y)), -10, distance + 10, limit=200)
    return float(of_data - 0.5 * np.log(2 * np.pi * np.e))


@pytest.mark.parametrize("distance", [0.5, 1.5, 3.0])
@pytest.mark.parametrize("share", [0.5, 0.9])
def test_two_answers_at_a_distance_tell_what_a_binary_channel_carries(distance: float, share: float) -> None:
    found = expected_information(
        [share, 1 - share], [PLAIN, Predictive(along(2, distance), NOTHING)], draws=4000
    )
    assert found.nats == pytest.approx(exactly(distance, share), abs=5 * found.std + 1e-3)
    assert found.std < 0.02


def test_what_all_answers_foresee_alike_tells_nothing() -> None:
    same = Predictive(along(0, 3.0), along(1, 2.0)[:, None])
    assert expected_information([0.3, 0.7], [same, same]).nats == pytest.approx(0.0, abs=1e-12)


def test_answers_that_are_far_apart_tell_all_there_is_to_know() -> None:
    probability = [0.2, 0.5, 0.3]
    foreseen = [Predictive(along(number, 40.0), NOTHING) for number in range(3)]
    assert expected_information(probability, foreseen).nats == pytest.approx(entropy(probability), abs=0.05)


@pytest.mark.parametrize("spread", [1.0, 5.0, 25.0])
def test_a_size_that_is_not_known_hides_what_parts_two_answers(spread: float) -> None:
    def told(size: float) -> float:
        loose = Predictive(along(0, 3.0), along(0, size)[:, None])
        return expected_information(
            [0.5, 0.5], [Predictive(np.zeros(6), along(0, size)[:, None]), loose]
        ).nats

    assert told(spread) < told(0.0)
    assert told(spread) == pytest.approx(exactly(3.0 / np.hypot(1.0, spread), 0.5), abs=0.03)


@pytest.mark.parametrize("seed", range(3))
def test_no_rotation_of_the_readings_changes_what_they_tell(seed: int) -> None:
    random = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(random.normal(size=(6, 6)))
    foreseen = [Predictive(random.normal(size=6), random.normal(size=(6, 2))) for _ in range(3)]
    turned = [Predictive(turn @ one.mean, turn @ one.spread) for one in foreseen]
    told = [expected_information([0.3, 0.3, 0.4], each, draws=3000) for each in (foreseen, turned)]
    assert told[0].nats == pytest.approx(told[1].nats, abs=4 * (told[0].std + told[1].std))


def test_probabilities_after_data_are_those_of_bayes() -> None:
    foreseen = [PLAIN, Predictive(along(0, 2.0), along(1, 3.0)[:, None])]
    data = np.array([1.5, -2.0, 0.3, 0.0, 0.0, 0.0])
    density = norm.pdf(1.5) * norm.pdf(-2.0), norm.pdf(1.5, 2.0) * norm.pdf(-2.0, 0.0, np.hypot(1.0, 3.0))
    expected = 0.8 * density[0] / (0.8 * density[0] + 0.2 * density[1])
    assert updated([0.8, 0.2], log_evidence(foreseen, data))[0] == pytest.approx(expected)


def test_the_two_answers_that_are_named_are_those_that_the_data_part() -> None:
    foreseen = [PLAIN, Predictive(along(0, 0.1), NOTHING), Predictive(along(1, 6.0), NOTHING)]
    assert best_parted([0.1, 0.5, 0.4], foreseen) == (1, 2)


def test_manoeuvres_that_were_expected_to_tell_more_have_told_more() -> None:
    random = np.random.default_rng(4)
    probability = np.array([0.4, 0.3, 0.2, 0.1])
    expected, come = [], []
    for _ in range(25):
        strength = np.exp(random.uniform(-2.0, 2.0))
        foreseen = [
            Predictive(strength * random.normal(size=8), random.normal(size=(8, 2))) for _ in probability
        ]
        expected.append(expected_information(list(probability), foreseen).nats)
        came = []
        for _ in range(60):
            truth = foreseen[int(random.choice(len(probability), p=probability))]
            data = truth.mean + truth.spread @ random.normal(size=2) + random.normal(size=8)
            came.append(
                entropy(probability) - entropy(updated(list(probability), log_evidence(foreseen, data)))
            )
        come.append(np.mean(came))
    assert spearmanr(expected, come).statistic > 0.9
    assert np.mean(come) == pytest.approx(np.mean(expected), rel=0.1)
