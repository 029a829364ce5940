"""Uncertainty budgets against Monte Carlo: the scatter of E and ν when sources are drawn, and what the budget says."""

import argparse
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from estimator.effects.effect import Effect
from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fit.budget.budget import Budget
from estimator.fit.budget.systematic import SYSTEMATIC, Stated, Systematic
from estimator.fit.estimate import estimate
from estimator.fit.nuisances import DISCRETISATION, USUAL
from estimator.fit.result import Estimate
from estimator.fit.settings import FitSettings
from estimator.forward.meshing import mesh_experiment
from estimator.inference.free_parameter import NormalPrior
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.simulation.acting import ActingEffect
from estimator.simulation.simulate import Resolution, simulate_exactly
from estimator.studies.paper_tables.block import GRASP_CENTRE, block
from estimator.workers import worker_pool

FloatArray = NDArray[np.float64]

PARAMETERS = ("youngs_modulus", "poisson_ratio")
ALL = "all"
"""The name under which every source is drawn at once."""

_TRUTH = Material(NeoHookean(), 15e3, 0.45)
# The same mesh for truth and fit: what the mesh is off by is measured, not drawn.
_GRADING = Grading(grasp_m=4e-3, anchor_m=8e-3, largest_m=20e-3, growth=2.0, layers=1)
_MESH = partial(mesh_experiment, grading=_GRADING)
_PRIOR = NormalPrior(0.45, 0.01)
# Of the gripper's way: under way, on arrival, and once it has stood there.
_WAY = (0.0, 0.25, 0.5, 0.5, 0.75, 1.0, 1.0)
_PHASES = ("hold", "ramp", "ramp", "hold", "ramp", "ramp", "hold")
_TIMES_S = (0.0, 1.0, 2.0, 4.0, 5.0, 6.0, 8.0)
_LENGTH_M, _TURN_RAD = 0.012, (0.3, 0.1, 0.2)
# A contribution below this share of the combined uncertainty is not compared: the fit does not converge further.
_NOTHING = 0.01
_CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Scatter:
    """The deviation of a parameter over so many draws about what exact data give, and its interval of 95 %."""

    deviation: float
    low: float
    high: float


def planned_pull() -> Experiment:
    """Return a pull that turns, with rows under way and while the gripper stands."""
    poses = [
        GripperPose(
            np.add(GRASP_CENTRE, (way * _LENGTH_M, 0.0, 0.0)), Rotation.from_rotvec(way * np.array(_TURN_RAD))
        )
        for way in _WAY
    ]
    return replace(block(poses), time=np.array(_TIMES_S), phase=_PHASES)


def fitted(experiment: Experiment, prior: NormalPrior = _PRIOR, stated: Stated | None = None) -> Estimate:
    """Estimate E and ν, with a budget where uncertainties are stated."""
    settings = FitSettings(priors={"poisson_ratio": prior}, nuisances=USUAL - {DISCRETISATION}, budget=stated)
    return estimate([experiment], settings=settings, mesh=_MESH)


def drawn(names: Collection[str], seed: int | Sequence[int]) -> dict[str, float]:
    """Draw each of these sources from its distribution, estimate, and return the parameters.

    Parameters
    ----------
    names : of sources, as a budget calls them
    """
    rng, planned = np.random.default_rng(seed), planned_pull()
    sensor = planned.sensor
    seen = _seen(planned, [name for name in names if name in SYSTEMATIC], rng)
    wrench, fiducials, position = seen.wrench.copy(), seen.fiducials.copy(), seen.position.copy()
    deviation = {"force": sensor.wrench_std[:3], "torque": sensor.wrench_std[3:]}
    for kind, channels in (("force", slice(0, 3)), ("torque", slice(3, 6))):
        if kind in names:
            wrench[:, channels] += deviation[kind] * rng.normal(size=(len(wrench), 3))
        if f"{kind}_tare" in names:
            wrench[:, channels] += deviation[kind] * rng.normal(size=3)
    if "bead" in names:
        fiducials += sensor.bead_std * rng.normal(size=fiducials.shape)
    if "rest_positions" in names:
        fiducials += sensor.bead_std * rng.normal(size=fiducials[0].shape)
    if "position" in names:
        position += sensor.position_std * rng.normal(size=position.shape)
    shift = _PRIOR.std * float(rng.normal()) if "prior_poisson_ratio" in names else 0.0
    prior = replace(_PRIOR, mean=_PRIOR.mean + shift)
    found = fitted(replace(seen, wrench=wrench, fiducials=fiducials, position=position), prior)
    return {name: found.parameters[name].value for name in PARAMETERS}


def recorded(planned: Experiment, acting: Sequence[ActingEffect] = ()) -> Experiment:
    """Return what sensors without noise would have seen, with whatever acts."""
    (seen,) = simulate_exactly([planned], _TRUTH, acting, resolution=Resolution(_GRADING, "hex27"))
    return seen


def scatter_of(values: Sequence[float], about: float) -> Scatter:
    """Return the scatter of draws about a value that is known."""
    count = len(values)
    square = float(np.sum(np.square(np.subtract(values, about))))
    ends = chi2.ppf([(1 + _CONFIDENCE) / 2, (1 - _CONFIDENCE) / 2], count)
    low, high = np.sqrt(square / ends)
    return Scatter(float(np.sqrt(square / count)), float(low), float(high))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what the benchmark needs to know."""
    parser.add_argument("--draws", type=int, default=16, help="of each source (default: %(default)s)")
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="NAME", help=f"sources; {ALL} for all of them at once"
    )
    parser.add_argument("--processes", type=int, help="default: one a core")


def lines(options: argparse.Namespace) -> Iterator[str]:
    """Give a line for each source, one for all of them, and how many scatters differ from the budget's."""
    exact = fitted(recorded(planned_pull()), stated=Stated())
    budget = exact.budget
    assert budget is not None
    names = [line.source.name for line in budget.lines]
    numbers = {name: number for number, name in enumerate((*names, ALL))}
    if unknown := set(options.only) - set(numbers):
        raise InputError(f"--only {min(unknown)}: no source; there are {', '.join(numbers)}")
    values: dict[str, list[dict[str, float]]] = {name: [] for name in options.only or numbers}
    with worker_pool(options.processes) as workers:
        jobs = {
            workers.submit(drawn, names if name == ALL else [name], [draw, numbers[name]]): name
            for name in values
            for draw in range(options.draws)
        }
        for job in as_completed(jobs):
            values[jobs[job]].append(job.result())
    yield f"{'source':28}  u(E), Pa  scatter (95 %)             u(ν)      scatter (95 %)"
    compared = outside = 0
    for name, of_source in values.items():
        cells = []
        for parameter in PARAMETERS:
            told = _told(budget, name, parameter)
            found = scatter_of([one[parameter] for one in of_source], exact.parameters[parameter].value)
            if told > _NOTHING * budget.combined[parameter]:
                compared += 1
                outside += not found.low <= told <= found.high
            cells.append(f"{told:8.3g}  {found.deviation:8.3g} ({found.low:.3g} to {found.high:.3g})")
        yield f"{name:28}  {cells[0]:36}  {cells[1]}"
    yield (
        f"{outside} of {compared} contributions above {100 * _NOTHING:g} % of the whole lie outside the interval of "
        f"their scatter; by chance {(1 - _CONFIDENCE) * compared:.1f} would"
    )


def _told(budget: Budget, name: str, parameter: str) -> float:
    """Return what a budget says of a source, or of all of them."""
    told: Mapping[str, float] = {line.source.name: line.contribution[parameter] for line in budget.lines}
    return budget.combined[parameter] if name == ALL else told[name]


def _seen(planned: Experiment, names: Sequence[str], rng: np.random.Generator) -> Experiment:
    """Draw systematic errors, and return what sensors without noise would see with them.

    What is measured while the gripper stands is the mean of a window that ends before it sets off: no latency shows in
    it, although the simulation, which knows rows alone, goes straight from one to the next.
    """
    acting = {name: _acting(SYSTEMATIC[name], rng) for name in names}
    seen = recorded(planned, [one for of_name in acting.values() for one in of_name])
    punctual = [name for name in names if not SYSTEMATIC[name].under_way]
    if len(punctual) == len(names):
        return seen
    in_time = recorded(planned, [one for name in punctual for one in acting[name]])
    standing = np.array([phase == "hold" for phase in planned.phase])
    return replace(
        seen,
        wrench=np.where(standing[:, None], in_time.wrench, seen.wrench),
        fiducials=np.where(standing[:, None, None], in_time.fiducials, seen.fiducials),
    )


def _acting(one: Systematic, rng: np.random.Generator) -> list[ActingEffect]:
    """Draw the amplitudes of a systematic error; those of one direction share a draw."""
    values: dict[str, dict[str, float]] = {}
    effects: dict[str, Effect] = {}
    for direction in one.directions:
        amount = one.assumed * float(rng.normal())
        for effect, amplitude in direction:
            effects[effect.name] = effect
            own = values.setdefault(effect.name, {a.name: 0.0 for a in effect.amplitudes})
            own[amplitude] = amount
    return [ActingEffect(effects[name], own) for name, own in values.items()]
