"""Is each device of a rig fit for a session? Who answers, and a few seconds of what it delivers while nothing moves."""

from collections.abc import Callable, Mapping
from functools import partial

from daq.device_checks.camera import check_camera
from daq.device_checks.force_sensor import check_force_sensor
from daq.device_checks.report import Check, DeviceReport
from daq.device_checks.robot import check_robot
from daq.devices import Devices
from daq.rig import Rig
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import Camera, ForceSensor, Robot

__all__ = ["Check", "DeviceReport", "check_devices"]


def check_devices(rig: Rig, devices: Devices, seconds: float) -> list[DeviceReport]:
    """Check every device by itself, so that one that is missing hides no other. Nothing moves.

    Parameters
    ----------
    seconds : how long to look at what each one delivers

    Raises
    ------
    RigError
        A driver says what cannot be right, or the calibration of the cameras cannot be read.
    """
    sizes, specifications = _calibrated_sizes(rig), rig.camera_specifications()
    reports = [
        _report(
            "force sensor",
            devices.force_sensor,
            partial(check_force_sensor, devices.force_sensor, rig, seconds),
        ),
        _report("robot", devices.robot, partial(check_robot, devices.robot, rig, seconds)),
    ]
    for camera in rig.cameras:
        device = devices.cameras[camera.name]
        wanted_fps = specifications[camera.name].frames_per_s
        check = partial(check_camera, device, wanted_fps, sizes.get(camera.name), seconds)
        reports.append(_report(f"camera {camera.name}", device, check))
    return reports


def _report(
    role: str, device: ForceSensor | Robot | Camera, check: Callable[[], list[Check]]
) -> DeviceReport:
    identity = None
    try:
        device.connect()
        identity = device.identity
        return DeviceReport(role, identity, (Check("reachable", True, identity.address), *check()))
    except DeviceError as error:
        name = "reachable" if identity is None else "stream"
        return DeviceReport(role, identity, (Check(name, False, str(error)),))
    finally:
        device.close()


def _calibrated_sizes(rig: Rig) -> Mapping[str, tuple[int, int]]:
    """Return the image sizes (px) that the calibrations are for, by camera; none without their file."""
    view = rig.only_view
    if view is not None and view.calibration.exists():
        model = view.camera()
        return {rig.cameras[0].name: (model.width, model.height)}
    if rig.stereo_calibration is None or not rig.stereo_calibration.exists():
        return {}
    calibration, (left, right) = rig.stereo(), rig.pair
    models = {left.name: calibration.left, right.name: calibration.right}
    return {name: (model.width, model.height) for name, model in models.items()}
