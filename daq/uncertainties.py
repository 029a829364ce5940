"""What a rig tells of the uncertainty of its devices: by its calibrations, its data sheets and its rig file."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.calibration_files.in_force import InForce, calibrations_in_force
from daq.calibration_files.outcome import HELD_OUT_SCALE, TURN_STD
from daq.calibration_files.record import CalibrationRecord
from daq.calibration_files.results import ForceResult, RobotResult, TimeResult, ToolResult
from daq.errors import RigError
from daq.rig import Rig
from estimator.experiment import Experiment, SensorNoise
from estimator.fit.budget.source import Origin
from estimator.fit.budget.systematic import CAMERA_SCALE, MOTION_DIRECTION, TORQUE_CENTRE, Stated

_LATENCY = {"force sensor": "force_latency", "cameras": "camera_latency"}
# Of what no rig tells: what simulated experiments have as well.
_USUAL_BEAD_M, _USUAL_POSITION_M = 5e-5, 3e-5


def stated_by_calibrations(rig: Rig) -> Stated:
    """Return the uncertainties that the calibrations in force for a rig found.

    Raises
    ------
    RigError
        A calibration file cannot be read.
    """
    in_force = calibrations_in_force(rig, {})
    sizes: dict[str, float] = {}
    origins: dict[str, Origin] = {}
    for name, size, file in _found(in_force):
        sizes[name] = size
        origins[name] = Origin("A", f"calibration {file}")
    return Stated(sizes, origins)


def _found(in_force: InForce) -> Iterator[tuple[str, float, str]]:
    """Yield name, standard uncertainty and file of everything that a calibration tells."""
    for kind, record in in_force.records.items():
        file, result = in_force.files[kind].name, record.result
        if isinstance(result, ForceResult):
            yield "tool_mass", result.mass_std_kg, file
        elif isinstance(result, ToolResult):
            yield TORQUE_CENTRE.name, result.std_m, file
        elif isinstance(result, RobotResult):
            for turn in _figures(record, TURN_STD):
                yield MOTION_DIRECTION.name, math.radians(turn), file
        elif isinstance(result, TimeResult):
            for stream in result.streams:
                yield _LATENCY[stream.stream], stream.std_s, file
        elif kind == "stereo":
            for scale in _figures(record, HELD_OUT_SCALE):
                yield CAMERA_SCALE.name, scale, file


def _figures(record: CalibrationRecord, name: str) -> list[float]:
    return [figure.value for figure in record.figures if figure.name == name and math.isfinite(figure.value)]


@dataclass(frozen=True, slots=True)
class PlannedNoise:
    """The noise that rows of a rig will have, and where its sizes come from."""

    sensor: SensorNoise
    origins: dict[str, Origin]


def planned_noise(rig: Rig, measured_s: float) -> PlannedNoise:
    """Return what a rig's devices and its rig file let one expect of the mean of a measuring window.

    The noise of a force sensor is taken for white, so that a mean over ``measured_s`` has so many samples' share of it.
    An only camera sees the beads from where the calibration in force says.

    Raises
    ------
    RigError
        There is no such driver, neither it nor the rig file tells of the force sensor's noise, or a calibration cannot
        be read.
    """
    sheet, extra = rig.force_sensor_specification(), rig.uncertainty
    force, torque, words = extra.force_n, extra.torque_nm, "uncertainty in the rig file"
    if sheet.noise_std is not None:
        # Without a rate it is the noise of one sample.
        samples = max((sheet.rate_hz or 0.0) * measured_s, 1.0)
        force = math.hypot(force, _rms(sheet.noise_std[:3]) / math.sqrt(samples))
        torque = math.hypot(torque, _rms(sheet.noise_std[3:]) / math.sqrt(samples))
        of_samples = "one sample" if samples == 1.0 else f"{samples:.0f} samples"
        words = f"data sheet of {rig.force_sensor.driver}, {of_samples}; {words}"
    if not (force > 0 and torque > 0):
        raise RigError(
            f"rig {rig.name!r}: the driver {rig.force_sensor.driver} tells no noise of its sensor; write force_n and "
            "torque_nm under [uncertainty]"
        )
    of_force = Origin("B", words)
    bead_m, rest = extra.fiducial_m or _USUAL_BEAD_M, rig.specimen.fiducials_m
    view = calibrations_in_force(rig, {}).apply(rig).only_view
    sensor = SensorNoise(
        force,
        torque,
        bead_m,
        extra.position_m or _USUAL_POSITION_M,
        rig.tool.mass_kg,
        rig.tool.centre_m,
        {} if view is None or not rest else view.noise_by_axis(rest, bead_m),
    )
    return PlannedNoise(
        sensor,
        {
            "force": of_force,
            "torque": of_force,
            "bead": _of_rig_file(extra.fiducial_m),
            "position": _of_rig_file(extra.position_m),
        },
    )


def as_measured(rig: Rig, rehearsed: Experiment) -> Experiment:
    """Return a rehearsed experiment with those coordinates of the beads alone that the rig's cameras measure."""
    beads = rehearsed.fiducials.copy()
    if not rig.measuring_cameras:
        none = np.empty((0, 3))
        return replace(rehearsed, fiducials_rest=none, fiducials=np.empty((len(beads), 0, 3)))
    if rig.planar_view is not None:
        beads[..., 2] = np.nan
    return replace(rehearsed, fiducials=beads)


def _of_rig_file(size: float) -> Origin:
    return Origin("B", "uncertainty in the rig file" if size else "assumed")


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
