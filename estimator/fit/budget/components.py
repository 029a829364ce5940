"""How each source of uncertainty moves the parameters, given how the estimate answers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fit.budget.gains import FittedCase, Response, pose_gain
from estimator.fit.budget.source import Device, Origin, Source
from estimator.fit.budget.systematic import NOISE, Stated, Systematic
from estimator.fit.nuisances import (
    FORCE_GAIN,
    GAIN_STD,
    REMAINING_ERROR,
    REST_POSITIONS,
    TARE,
    FloatingNuisance,
    nuisance_columns,
)
from estimator.inference.free_parameter import InternalPrior

FloatArray = NDArray[np.float64]
# By (experiment, state), the change (c, k) of a state's mean by each component of an error.
Changes = Mapping[tuple[int, int], FloatArray]

_FORCE, _TORQUE = slice(0, 3), slice(3, 6)
_BEADS = slice(6, None)


@dataclass(frozen=True, eq=False)
class Component:
    """A source with what it does to the parameters.

    Attributes
    ----------
    source : what it is
    spread : the change (p, k) of the internal variables by each of its k independent unknowns, at its size
    """

    source: Source
    spread: FloatArray


def noise_components(case: FittedCase, response: Response, stated: Stated) -> list[Component]:
    """Return the noise of rows: of force, torque and beads where they were measured, and of the reported position."""
    kinds: tuple[tuple[str, str, Device, str, slice], ...] = (
        ("force", "noise of the force", "force sensor", "N", _FORCE),
        ("torque", "noise of the torque", "force sensor", "N·m", _TORQUE),
        ("bead", "noise of the beads", "cameras", "m", _BEADS),
    )
    found = [
        Component(
            Source(name, words, device, _rms_of(case, channels), unit, _origin(stated, name), known=True),
            _by_noise(case, response, channels),
        )
        for name, words, device, unit, channels in kinds
        if _measured(case, channels)
    ]
    return [*found, *_pose_components(case, response, stated)]


def _pose_components(case: FittedCase, response: Response, stated: Stated) -> list[Component]:
    """Return the noise of the reported position, and that of the turn where it is stated."""
    moved = [np.sqrt(case.pose_variance(m)) * pose_gain(response.gains, case, m) for m in case.means]
    found = []
    for name, unit, axes in (("position", "m", slice(0, 3)), ("orientation", "rad", slice(3, 6))):
        size = float(np.sqrt(np.mean([one.sensor.pose_std[axes] ** 2 for one in case.experiments])))
        if not size and name == "orientation":
            continue
        origin = _origin(stated, name)
        source = Source(
            name, f"noise of the robot's {name}", "robot", size, unit, origin, known=case.pose_known
        )
        found.append(Component(source, np.hstack([one[:, axes] for one in moved])))
    return found


def nuisance_components(case: FittedCase, response: Response) -> list[Component]:
    """Return what every laboratory does not know: tares and rest positions, and a gain where the fit estimates one.

    Tares and rest positions are off whether the fit knows of it or not.
    """
    zeroed = Origin("B", "the zero was taken with the noise of a row")
    kinds: tuple[tuple[FloatingNuisance, str, str, Device, str, slice], ...] = (
        (TARE, "force_tare", "tare of the force", "force sensor", "N", _FORCE),
        (TARE, "torque_tare", "tare of the torque", "force sensor", "N·m", _TORQUE),
        (REST_POSITIONS, "rest_positions", "rest positions of the beads", "cameras", "m", _BEADS),
    )
    found = []
    for nuisance, name, words, device, unit, channels in kinds:
        if _measured(case, channels):
            known = nuisance.name in case.nuisances
            source = Source(name, words, device, _rms_of(case, channels), unit, zeroed, known)
            # Each experiment has a tare, of six unknowns.
            unknowns = channels if nuisance.by_experiment else slice(None)
            moved = _by_nuisance(case, response, nuisance)[:, :, unknowns]
            found.append(Component(source, moved.reshape(len(moved), -1)))
    if FORCE_GAIN.name in case.nuisances:
        origin = Origin("B", "prior of the fit, which estimates it")
        source = Source(FORCE_GAIN.name, "force gain", "force sensor", GAIN_STD, "1", origin, known=True)
        found.append(Component(source, _by_nuisance(case, response, FORCE_GAIN)[:, 0]))
    return found


def systematic_component(
    case: FittedCase, response: Response, one: Systematic, stated: Stated, changes: Changes
) -> Component:
    """Return an error that the fit does not know of; ``changes`` are those by its size."""
    source = Source(
        one.name, one.words, one.device, stated.size_of(one), one.unit, stated.origin_of(one), known=False
    )
    parts = [response.gains[m.experiment, m.state] @ changes[m.experiment, m.state] for m in case.means]
    return Component(source, np.sum(parts, axis=0))


def prior_components(case: FittedCase, response: Response) -> list[Component]:
    """Return the priors of the parameters that have one."""
    found = []
    for number in np.flatnonzero(np.diag(case.prior)):
        parameter = case.free[number]
        usual = isinstance(parameter.prior, InternalPrior)
        source = Source(
            f"prior_{parameter.name}",
            f"prior of {parameter.label}",
            "prior knowledge",
            parameter.prior_scale * parameter.slope,
            parameter.unit,
            Origin("B", "what is usual" if usual else "stated"),
            known=True,
        )
        found.append(Component(source, response.by_prior[:, number : number + 1] * parameter.prior_scale))
    return found


def bias_component(bias: FloatArray) -> Component:
    """Return what the correction for the mesh leaves, (p,) internal units."""
    origin = Origin("B", "of the correction, measured on a finer mesh")
    source = Source("discretisation", "discretisation", "model", REMAINING_ERROR, "1", origin, known=True)
    return Component(source, bias[:, None])


def misfit_component(known: Sequence[Component], inflation: float) -> Component:
    """Return what the measurements scatter beyond their stated noise, as an estimate's interval has it.

    ``known`` are the errors of measurement that the fit knows of, but for the pose's: the robot says where the gripper
    is as surely as it states, however far the rest scatters.
    """
    surplus = float(np.sqrt(inflation**2 - 1.0))
    origin = Origin("A", "residuals, in units of the stated noise")
    source = Source("misfit", "scatter beyond the noise", "model", surplus, "1", origin, known=True)
    return Component(source, surplus * np.hstack([one.spread for one in known]))


def _by_noise(case: FittedCase, response: Response, channels: slice) -> FloatArray:
    """Return the change (p, k) by the noise of each mean of each state."""
    blocks = []
    for mean in case.means:
        deviation = np.sqrt(mean.variance / np.where(mean.count > 0, mean.count, np.inf))
        blocks.append((response.gains[mean.experiment, mean.state] * deviation)[:, channels])
    return np.hstack(blocks)


def _by_nuisance(case: FittedCase, response: Response, nuisance: FloatingNuisance) -> FloatArray:
    """Return the change (p, e, k) by the k unknowns of each experiment, or of all of them (e = 1)."""
    experiments, moved = len(case.experiments), []
    for mean in case.means:
        deviation, observation = np.sqrt(mean.variance), case.observation(mean)
        columns = nuisance_columns([nuisance], deviation, observation, mean.experiment, experiments)
        moved.append(response.gains[mean.experiment, mean.state] @ columns)
    total = np.sum(moved, axis=0)
    return np.asarray(total.reshape(len(total), experiments if nuisance.by_experiment else 1, -1))


def _origin(stated: Stated, name: str) -> Origin:
    return stated.origins.get(name, NOISE[name])


def _measured(case: FittedCase, channels: slice) -> bool:
    return any(bool(mean.count[channels].any()) for mean in case.means)


def _rms_of(case: FittedCase, channels: slice) -> float:
    return float(np.sqrt(np.mean([mean.variance[channels].mean() for mean in case.means])))
