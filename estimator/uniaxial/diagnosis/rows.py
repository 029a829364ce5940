"""The rows of a test that a diagnosis computes with: means over short pieces, with their noise.

A machine writes thousands of rows. Neighbours are averaged where little happens, and never across a turning point.
"""

from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from estimator.uniaxial.diagnosis.bench_test import BenchTest
from estimator.uniaxial.loading import noise_of
from estimator.uniaxial.records import FloatArray

MOST_ROWS = 160
_LEAST_REVERSAL = 0.02  # of the range of strain
_IN_NOISE = 8.0
_LEAST_NOISE = 2e-4  # of the range of stress: what no load cell resolves
_TIME_WEIGHT = 0.5
_CARRIES_REVERSE = 0.02  # of the largest stress

IndexArray = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """The rows of one test.

    Attributes
    ----------
    test : that they come from
    strain, stress, time : (n,) means; time in s, or counted in rows where the test has none
    noise : (n,) standard deviation of a mean, Pa
    part : (n,) number of the part between two turning points that a row lies in
    carries_reverse : whether the specimen was seen to carry load the other way
    """

    test: BenchTest
    strain: FloatArray
    stress: FloatArray
    time: FloatArray
    noise: FloatArray
    part: IndexArray
    carries_reverse: bool

    @property
    def scale(self) -> float:
        """Root mean square stress, Pa."""
        return float(np.sqrt(np.mean(self.stress**2)))


def rows_of(test: BenchTest) -> Rows:
    """Return the rows of a test, at most ``MOST_ROWS`` and its turning points."""
    count = len(test.strain)
    time = np.arange(count, dtype=np.float64) if test.time is None else test.time - test.time[0]
    turns = turning_points(test.strain)
    edges = _edges(test.strain, test.stress, time, turns)
    sizes = np.diff(edges)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.add.reduceat(values, edges[:-1]) / sizes)

    noise = max(noise_of(test.stress), _LEAST_NOISE * float(np.ptp(test.stress)))
    return Rows(
        test=test,
        strain=mean(test.strain),
        stress=mean(test.stress),
        time=mean(time),
        noise=noise / np.sqrt(sizes),
        part=np.searchsorted(turns, edges[:-1], side="left").astype(np.intp),
        carries_reverse=test.mode == "shear"
        or float(np.sort(test.stress)[count // 50]) < -_CARRIES_REVERSE * float(test.stress.max()),
    )


def turning_points(strain: FloatArray) -> IndexArray:
    """Return the places at which a course turns by more than noise, the turning rows themselves."""
    least = max(_IN_NOISE * noise_of(strain), _LEAST_REVERSAL * float(np.ptp(strain)))
    found, extreme, direction = [], 0, 0
    for place in range(1, len(strain)):
        away = float(strain[place] - strain[extreme])
        if direction == 0:
            if abs(away) > least:
                direction, extreme = (1 if away > 0 else -1), place
        elif away * direction >= 0:
            extreme = place
        elif abs(away) > least:
            found.append(extreme)
            direction, extreme = -direction, place
    return np.array(found, dtype=np.intp)


def _edges(strain: FloatArray, stress: FloatArray, time: FloatArray, turns: IndexArray) -> IndexArray:
    """Return where pieces begin, and the end: the piece that reaches farthest is halved until there are enough."""
    spans = (max(float(np.ptp(values)), 1e-300) for values in (strain, stress, time))
    channels = [
        values * weight / span
        for values, span, weight in zip((strain, stress, time), spans, (1, 1, _TIME_WEIGHT), strict=True)
    ]
    pieces: list[tuple[float, int, int]] = []

    def add(begin: int, end: int) -> None:
        if end > begin:
            reach = max(float(np.ptp(channel[begin:end])) for channel in channels)
            heappush(pieces, (-reach if end - begin > 1 else 1.0, begin, end))

    last = 0
    for turn in turns:
        add(last, int(turn))
        add(int(turn), int(turn) + 1)
        last = int(turn) + 1
    add(last, len(strain))
    while len(pieces) < MOST_ROWS and pieces[0][0] <= 0:
        _, begin, end = heappop(pieces)
        add(begin, (begin + end) // 2)
        add((begin + end) // 2, end)
    return np.array([*sorted(begin for _, begin, _ in pieces), len(strain)], dtype=np.intp)
