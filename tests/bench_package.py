"""The package of ``examples/bench-devices`` as pip installs it, and a rig file of its devices."""

import shutil
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

from daq.rig import CameraDevice, Device, write_rig
from daq.virtual_rig.layout import REST_TOOL, Addresses, rig_description
from daq.virtual_rig.rendering.scene import flea2_pair

PACKAGE = Path(__file__).resolve().parents[1] / "examples" / "bench-devices"
ADDRESSES = Addresses(1, 2, 3, 4, 5, 6, ("tcp://127.0.0.1:7", "tcp://127.0.0.1:8"))


def install(source: Path, target: Path) -> None:
    """Install the package into a folder, beside nothing else, from a copy."""
    shutil.copytree(PACKAGE, source, ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
    options = ["--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--disable-pip-version-check"]
    subprocess.run(
        [sys.executable, "-m", "pip", "install", *options, "--target", str(target), str(source)], check=True
    )


def rig_file(folder: Path, cameras: int) -> Path:
    """Write a rig of the installed package's devices, and return its file."""
    devices = import_module("bench_devices")
    calibration = folder / "stereo.toml"
    flea2_pair().save(calibration)
    rig = replace(
        rig_description(ADDRESSES, calibration),
        stereo_calibration=calibration if cameras > 1 else None,
        force_sensor=Device("bench_sensor", devices.SensorSettings()),
        robot=Device("bench_arm", devices.ArmSettings(REST_TOOL)),
        cameras=tuple(
            CameraDevice(f"camera{number}", "bench_camera", devices.CameraSettings())
            for number in range(1, cameras + 1)
        ),
    )
    write_rig(rig, folder / "rig.toml")
    return folder / "rig.toml"
