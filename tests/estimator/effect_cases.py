"""Experiments with simple motions and loads, on which effects have closed forms."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Effect, Motion, Readings

FloatArray = NDArray[np.float64]

ROLL = (np.pi / 4, 0.0, 0.0)
YAW = (0.0, 0.0, np.pi / 6)
STIFFNESS = 100.0  # N/m, of the tissue in every motion here


def there_and_back(order: int = 1, turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Motion:
    """20 mm along +x in 20 rows while turning, 5 rows of standing, and back; the load is that of a spring."""
    way = np.concatenate([np.linspace(0, 1, 21), np.ones(5), np.linspace(1, 0, 21)[1:]])
    rest = REFERENCE_BLOCK
    rotation = Rotation.from_rotvec(way[:, None] * np.array(turn_rad))
    position = np.array(rest.grasp.centre) + 0.02 * way[:, None] * [1.0, 0.0, 0.0]
    load = np.zeros((len(way), 6))
    load[:, 0] = -STIFFNESS * 0.02 * way
    beads = rest.fiducials_rest + 0.01 * way[:, None, None] * np.array([1.0, 0.2, 0.0])
    experiment = replace(
        rest,
        order=order,
        sensor=replace(rest.sensor, tool_mass=0.35, tool_centre=(0.0, 0.0, 0.06)),
        time=4.0 * np.arange(len(way)),
        phase=21 * ("ramp",) + 5 * ("hold",) + 20 * ("return",),
        step=np.arange(len(way)),
        position=position,
        quaternion_wxyz=rotation.as_quat(scalar_first=True),
        wrench=load,
        fiducials=beads,
    )
    return Motion(experiment, position, rotation, load, load, experiment.time)


def felt(motion: Motion, wrench: FloatArray | None = None) -> Readings:
    """What perfect sensors read of a motion, or of another constant wrench (6,)."""
    load = motion.load if wrench is None else np.tile(wrench, (len(motion.load), 1))
    beads = motion.experiment.fiducials
    where = motion.position
    return Readings(motion.experiment, where, motion.rotation, where, load, beads, load[0], beads[0])


def three_experiments() -> list[Readings]:
    """The same way out and back three times, the gripper turned about z and about x in the later ones."""
    return [felt(there_and_back(1)), felt(there_and_back(2, YAW)), felt(there_and_back(3, ROLL))]


def measured(readings: Readings, fiducials: FloatArray) -> Readings:
    """The same prediction beside other measured fiducials (n, m, 3)."""
    return replace(readings, experiment=replace(readings.experiment, fiducials=fiducials))


def at_null(effect: Effect) -> dict[str, float]:
    """All amplitudes zero."""
    return {amplitude.name: 0.0 for amplitude in effect.amplitudes}


def with_values(effect: Effect, given: Mapping[str, float]) -> dict[str, float]:
    """The given values; amplitudes that are not among them are zero."""
    return {**at_null(effect), **given}


def position_change(effect: Effect, motion: Motion, **given: float) -> FloatArray:
    """By how much an effect moves the gripper (n, 3), m."""
    return effect.motion(motion, with_values(effect, given)).position - motion.position


def wrench_change(effect: Effect, readings: Readings, **given: float) -> FloatArray:
    """What an effect adds to the wrench (n, 6)."""
    return effect.readings(readings, with_values(effect, given)).wrench - readings.wrench
