"""What a rig tells of its devices' uncertainties: by calibrations, data sheets and its file."""

import math
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from daq.calibration_files.keeping import keep
from daq.calibration_files.outcome import HELD_OUT_SCALE, TURN_STD, Figure, Kind, Outcome
from daq.calibration_files.results import (
    ForceResult,
    RobotResult,
    StreamLatency,
    TimeResult,
    ToolResult,
)
from daq.errors import RigError
from daq.rig import Device, Rig, Transform, Uncertainty
from daq.trajectories.planned import planned_experiment
from daq.trajectories.routines import NAMED
from daq.uncertainties import as_measured, planned_noise, stated_by_calibrations
from daq.virtual_rig.layout import SPECIMEN, Addresses, rig_description
from daq.virtual_rig.rendering.scene import flea2_above, flea2_pair
from daq.vision.planar import PlanarView
from estimator.fit.budget.source import Origin
from robot_drivers.ati.netft import NetFTSettings
from robot_drivers.ati.transducer.gamma import GAGE_NOISE_STD
from robot_drivers.universal_robots import URWrenchSettings

NOW = datetime(2026, 5, 4, 12, tzinfo=UTC)
_SIX = (0.0,) * 6
_CURVE = ((-0.01, 0.0, 0.01), (0.2, 0.9, 0.3), (0.01, 0.01, 0.01))
_HERE = Transform((0.0, 0.0, 0.0))


def rig(folder: Path) -> Rig:
    described = rig_description(
        Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2")), folder / "stereo.toml"
    )
    return replace(described, calibration=folder / "calibration")


def kept(described: Rig, kind: Kind, result: object, *figures: Figure, accepted: bool = True) -> None:
    outcome: Outcome[Any] = Outcome(kind, result, figures, lambda plot: None)
    assert described.calibration is not None
    keep(outcome, described.calibration, described.name, {}, accepted=accepted, now=NOW)


def test_each_calibration_tells_the_errors_that_it_leaves(tmp_path: Path) -> None:
    described = rig(tmp_path)
    kept(described, "force", ForceResult(0.35, 2e-4, (0.0, 0.0, 0.06), (1e-4,) * 3, _SIX, _SIX, _SIX))
    kept(described, "tool", ToolResult((0.0, 0.0, 0.0), (0.0, 0.0, 0.14), 3e-5))
    kept(
        described,
        "robot",
        RobotResult(_HERE, _HERE, (0.0, 0.0, 0.0), 1e-4, 1e-4),
        Figure(TURN_STD, 0.1, "°"),
    )
    kept(
        described,
        "time",
        TimeResult(
            "sway",
            (
                StreamLatency("force sensor", 0.02, 1e-4, *_CURVE),
                StreamLatency("cameras", 0.03, 2e-4, *_CURVE),
            ),
        ),
    )
    kept(described, "stereo", flea2_pair(), Figure(HELD_OUT_SCALE, 4e-4, ""))
    stated = stated_by_calibrations(described)
    assert dict(stated.sizes) == pytest.approx(
        {
            "tool_mass": 2e-4,
            "torque_centre": 3e-5,
            "motion_direction": math.radians(0.1),
            "force_latency": 1e-4,
            "camera_latency": 2e-4,
            "camera_scale": 4e-4,
        }
    )
    assert stated.origins["tool_mass"] == Origin("A", "calibration force_2026-05-04_120000.toml")
    assert stated.origins.keys() == stated.sizes.keys()


def test_a_rejected_calibration_tells_nothing(tmp_path: Path) -> None:
    described = rig(tmp_path)
    kept(described, "tool", ToolResult((0.0, 0.0, 0.0), (0.0, 0.0, 0.14), 3e-5), accepted=False)
    assert not stated_by_calibrations(described).sizes
    assert not stated_by_calibrations(replace(described, calibration=None)).sizes


@pytest.mark.parametrize(("rate_hz", "samples"), [(None, 1), (1000, 800), (7000, 5600)])
def test_noise_of_a_plan_is_that_of_the_data_sheet_over_a_window(
    tmp_path: Path, rate_hz: int | None, samples: int
) -> None:
    sensor = Device("netft", NetFTSettings(host="ft", rate_hz=rate_hz))
    found = planned_noise(replace(rig(tmp_path), force_sensor=sensor), measured_s=0.8)
    sheet = math.sqrt(sum(std**2 for std in GAGE_NOISE_STD[:3]) / 3)
    assert found.sensor.force_std == pytest.approx(sheet / math.sqrt(samples))
    assert found.origins["force"].words.startswith("data sheet of netft, ")
    assert found.origins["force"].evaluation == "B"


def test_what_the_rig_file_states_is_added(tmp_path: Path) -> None:
    sensor = Device("netft", NetFTSettings(host="ft", rate_hz=7000))
    stated = replace(
        rig(tmp_path), force_sensor=sensor, uncertainty=Uncertainty(force_n=0.05, fiducial_m=2e-5)
    )
    found = planned_noise(stated, 0.8)
    assert found.sensor.force_std == pytest.approx(0.05, rel=1e-3)
    assert found.sensor.fiducial_std == 2e-5
    assert found.origins["bead"].words == "uncertainty in the rig file"
    assert found.origins["position"].words == "assumed"


def test_a_sensor_without_a_told_noise_needs_one_in_the_rig_file(tmp_path: Path) -> None:
    arm = Device("ur_flange", URWrenchSettings(host="ur"))
    silent = replace(rig(tmp_path), force_sensor=arm, uncertainty=Uncertainty())
    with pytest.raises(RigError, match="tells no noise of its sensor; write force_n and torque_nm"):
        planned_noise(silent, 0.8)
    told = replace(silent, uncertainty=Uncertainty(force_n=1.0, torque_nm=0.1))
    assert planned_noise(told, 0.8).sensor.force_std == 1.0


def one_camera(folder: Path, view: PlanarView | None) -> Rig:
    described = rig(folder)
    return replace(described, cameras=described.cameras[:1], stereo_calibration=None, planar_view=view)


def test_a_plan_counts_on_no_more_than_the_cameras_measure(tmp_path: Path) -> None:
    camera = tmp_path / "camera.toml"
    flea2_pair().left.save(camera)
    planar = one_camera(tmp_path, PlanarView(camera, 2e-4))
    sensor = planned_noise(planar, 0.8).sensor
    laid_out = planned_experiment(next(iter(NAMED.values()))(), SPECIMEN, sensor, order=1)
    rehearsed = replace(laid_out, fiducials=np.ones_like(laid_out.fiducials))

    of_two = as_measured(rig(tmp_path), rehearsed)
    assert np.array_equal(of_two.fiducials, rehearsed.fiducials)
    of_one = as_measured(planar, rehearsed)
    assert np.isnan(of_one.fiducials[..., 2]).all()
    assert np.array_equal(of_one.fiducials[..., :2], rehearsed.fiducials[..., :2])
    assert len(of_one.fiducials_rest) == len(SPECIMEN.fiducials_m)
    of_none = as_measured(one_camera(tmp_path, None), rehearsed)
    assert of_none.fiducials_rest.shape == (0, 3)
    assert of_none.fiducials.shape == (len(rehearsed.time), 0, 3)
    assert not np.isnan(rehearsed.fiducials).any()


def test_a_plan_of_one_camera_counts_on_the_uncertain_height_of_the_beads(tmp_path: Path) -> None:
    camera = tmp_path / "camera.toml"
    flea2_pair().left.save(camera)
    low, high = (
        planned_noise(one_camera(tmp_path, PlanarView(camera, std)), 0.8).sensor for std in (1e-9, 2e-4)
    )
    assert low.by_channel == pytest.approx({"x": low.fiducial_std, "y": low.fiducial_std})
    assert max(high.by_channel.values()) > 1.1 * low.fiducial_std
    assert not planned_noise(rig(tmp_path), 0.8).sensor.by_channel


def test_a_plan_of_one_camera_goes_by_its_calibration_in_force(tmp_path: Path) -> None:
    camera = tmp_path / "camera.toml"
    flea2_pair().left.save(camera)
    believed = one_camera(tmp_path, PlanarView(camera, 2e-4))
    before = planned_noise(believed, 0.8).sensor
    kept(believed, "camera", flea2_above())
    after = planned_noise(believed, 0.8).sensor
    assert max(after.by_channel.values()) < 0.5 * max(before.by_channel.values())
    never = one_camera(tmp_path, PlanarView(tmp_path / "never.toml", 2e-4))
    assert planned_noise(never, 0.8).sensor == after
