"""How often the 95 % intervals hold the truth: ``python -m estimator.fit.coverage --sets 200``.

Every data set has a phantom, a retraction, errors and an estimation of its own. The truth is solved with cubic
elements on a mesh that is neither of the fit's, for E between 5 and 40 kPa and ν between 0.40 and 0.49; on top come
noise of all sensors, of the gripper's reported position, a tare and misplaced rest positions, as large as the
experiment states.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import EstimatorError, InputError
from estimator.experiment import Box, Environment, Experiment, Grasp, Phantom, SensorNoise
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fit.estimate import estimate
from estimator.fit.settings import FitSettings, material_of
from estimator.forward.meshing import mesh_experiment
from estimator.forward.model import ForwardModel
from estimator.inference.normal import Z95
from estimator.materials import NeoHookean
from estimator.result_lines import append_result, read_results
from estimator.workers import worker_pool

FloatArray = NDArray[np.float64]

PARAMETERS = ("youngs_modulus", "poisson_ratio")

_SIZE_M = (0.06, 0.03, 0.01)
_GRASP = Box((0.018, -0.015, -0.005), (0.03, 0.015, 0.005))
_FIDUCIALS_MM = [(x, y, 5.0) for x in (-18.0, -6.0, 6.0) for y in (-9.0, 0.0, 9.0)]
_SENSOR = SensorNoise(force_std=0.02, torque_std=5e-4, fiducial_std=5e-5, position_std=3e-5)
_STEPS, _ROWS = 4, 4
# On it E and ν are off by a few hundredths of what the fit's mesh is off by.
_TRUTH_GRADING = Grading(grasp_m=0.5e-3, anchor_m=1e-3, largest_m=8e-3, growth=2.5, layers=1)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one data set.

    Attributes
    ----------
    seed : of its truth and its errors
    truth, values : by parameter
    intervals : 95 % intervals by parameter
    noise_ratio : of the fit
    failure : why there is no fit; empty where there is one
    """

    seed: int
    truth: Mapping[str, float]
    values: Mapping[str, float]
    intervals: Mapping[str, Sequence[float]]
    noise_ratio: float
    failure: str = ""

    def __post_init__(self) -> None:
        told = () if self.failure else (self.truth, self.values, self.intervals)
        if any(name not in table for table in told for name in PARAMETERS):
            raise ValueError(f"{' or '.join(PARAMETERS)} is missing")
        if any(len(interval) != 2 for interval in self.intervals.values()):
            raise ValueError("an interval has not two ends")

    def holds(self, name: str) -> bool:
        """Tell whether the interval of a parameter holds its true value."""
        low, high = self.intervals[name]
        return low <= self.truth[name] <= high


def data_set(seed: int, noise: float = 1.0) -> tuple[dict[str, float], Experiment]:
    """Return true parameter values and an experiment on the phantom that has them.

    Parameters
    ----------
    noise : by which all its errors are multiplied
    """
    rng = np.random.default_rng(seed)
    truth = {
        "youngs_modulus": float(np.exp(rng.uniform(np.log(5e3), np.log(40e3)))),
        "poisson_ratio": float((1 - np.exp(rng.uniform(np.log(1 - 2 * 0.49), np.log(1 - 2 * 0.40)))) / 2),
    }
    planned = _planned(rng.uniform(0.006, 0.015), np.radians(rng.uniform(-25.0, 25.0, 3)))
    model = ForwardModel(mesh_experiment(planned, _TRUTH_GRADING, "hex64"), [planned])
    schedule = model.schedules[0]
    states = model.predict(material_of(NeoHookean(), truth), [range(len(schedule.poses))])[0]
    wrench = np.array([states[state].wrench for state in schedule.state_of_row])
    fiducials = np.array([states[state].fiducials for state in schedule.state_of_row])
    deviation = noise * np.repeat([_SENSOR.force_std, _SENSOR.torque_std], 3)
    seen_std, moved_std = noise * _SENSOR.fiducial_std, noise * _SENSOR.position_std
    tare, misplaced = deviation * rng.normal(size=6), rng.normal(0.0, seen_std, fiducials[0].shape)
    return truth, replace(
        planned,
        position=planned.position + rng.normal(0.0, moved_std, planned.position.shape),
        wrench=wrench + tare + deviation * rng.normal(size=wrench.shape),
        fiducials=fiducials + misplaced + rng.normal(0.0, seen_std, fiducials.shape),
    )


def outcome_of(seed: int, settings: FitSettings) -> Outcome:
    """Make a data set and estimate from it."""
    truth, experiment = data_set(seed)
    try:
        found = estimate([experiment], settings=settings)
    except EstimatorError as failure:
        return Outcome(seed, truth, {}, {}, float("nan"), str(failure))
    return Outcome(
        seed,
        truth,
        {name: parameter.value for name, parameter in found.parameters.items()},
        {name: parameter.interval95 for name, parameter in found.parameters.items()},
        found.noise_ratio,
    )


def campaign(
    seeds: Sequence[int], processes: int | None = None, settings: FitSettings | None = None
) -> Iterator[Outcome]:
    """Yield the outcome of every seed as it comes in, from so many processes, by default one a core."""
    with worker_pool(processes) as workers:
        pending = [workers.submit(outcome_of, seed, settings or FitSettings()) for seed in seeds]
        for done in as_completed(pending):
            yield done.result()


def wilson(held: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209)."""
    share, z2 = held / count, Z95**2
    centre = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = Z95 / (1 + z2 / count) * np.sqrt(share * (1 - share) / count + z2 / (4 * count**2))
    return float(centre - half), float(centre + half)


def table(outcomes: Sequence[Outcome]) -> str:
    """Return the coverage of each parameter in words; a fit that failed holds nothing."""
    lines = []
    for name in PARAMETERS:
        held = sum(not one.failure and one.holds(name) for one in outcomes)
        low, high = wilson(held, len(outcomes))
        lines.append(
            f"{name}: {100 * held / len(outcomes):.1f} % of {len(outcomes)} intervals hold the truth "
            f"(95 %: {100 * low:.1f} to {100 * high:.1f})"
        )
    failed = [one for one in outcomes if one.failure]
    lines += [f"{len(failed)} fits failed"] + [f"  seed {one.seed}: {one.failure}" for one in failed]
    ratios = [one.noise_ratio for one in outcomes if not one.failure]
    return "\n".join([*lines, f"residuals: {np.mean(ratios):.3f} times the stated noise on average"])


def _planned(length_m: float, turn_rad: FloatArray) -> Experiment:
    """Return a sheet held by its face at lowest x, pulled along +x while it turns, with rest and all rows of a step."""
    half = np.array(_SIZE_M) / 2
    way = np.repeat(np.linspace(0.0, 1.0, _STEPS + 1), _ROWS)
    centre = (np.array(_GRASP.lower) + _GRASP.upper) / 2
    fiducials = 1e-3 * np.array(_FIDUCIALS_MM)
    return Experiment(
        name="pull",
        phantom_id="sheet",
        order=1,
        phantom=Phantom("block", _SIZE_M),
        anchors=(Box((-half[0], -half[1], -half[2]), (-half[0], half[1], half[2])),),
        grasp=Grasp(_GRASP, (centre[0], centre[1], centre[2])),
        trajectory_kind="other",
        environment=Environment(),
        sensor=_SENSOR,
        fiducials_rest=fiducials,
        time=np.arange(len(way), dtype=float),
        phase=("hold",) * len(way),
        step=np.repeat(np.arange(_STEPS + 1), _ROWS),
        position=centre + np.outer(way, [length_m, 0.0, 0.0]),
        quaternion_wxyz=Rotation.from_rotvec(np.outer(way, turn_rad)).as_quat(scalar_first=True),
        wrench=np.zeros((len(way), 6)),
        fiducials=np.tile(fiducials, (len(way), 1, 1)),
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a campaign and print the coverage; finished sets of ``--output`` are not made again."""
    parser = argparse.ArgumentParser(
        prog="python -m estimator.fit.coverage", description="Coverage of the 95 % intervals."
    )
    parser.add_argument("--sets", type=int, default=200, help="data sets (default: %(default)s)")
    parser.add_argument("--processes", type=int, help="default: one a core")
    parser.add_argument("--profile", action="store_true", help="intervals by profile likelihood")
    parser.add_argument(
        "--output", type=Path, metavar="FILE", help="a line of JSON for each set; resumes from it"
    )
    options = parser.parse_args(arguments)
    if options.sets < 1:
        parser.error("--sets must be at least 1")
    settings = FitSettings(intervals="profile" if options.profile else "linear")
    try:
        outcomes = read_results(Outcome, options.output) if options.output else []
    except InputError as error:
        parser.exit(2, f"{parser.prog}: {error}\n")
    finished = {one.seed for one in outcomes}
    for one in campaign([s for s in range(options.sets) if s not in finished], options.processes, settings):
        outcomes.append(one)
        sys.stderr.write(f"\r{len(outcomes)} of {options.sets} sets")
        if options.output:
            append_result(options.output, one)
    sys.stderr.write("\n")
    sys.stdout.write(table(outcomes) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
